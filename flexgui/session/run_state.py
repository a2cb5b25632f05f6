"""How the running job stands, as one record that events turn into the next, and what a scenario's
search is about."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from flexgui.core.identify.unknowns import GAIN, OFFSET, START
from flexgui.core.model import Model
from flexgui.core.parameters import Parameter
from flexgui.core.results import Generation
from flexgui.core.scenario.schema import Scenario
from flexgui.jobs import (
    Advanced,
    Event,
    Failed,
    Finished,
    NewGeneration,
    Paused,
    Queued,
    Resumed,
    Stage,
    Started,
    Stopped,
    WorkerLost,
)

IDLE, QUEUED, RUNNING, PAUSED = "idle", "queued", "running", "paused"
STOPPING = "stopping"
DONE, FAILED, STOPPED, LOST = "done", "failed", "stopped", "lost"
BUSY = (QUEUED, RUNNING, PAUSED, STOPPING)


@dataclass(frozen=True)
class RunState:
    """One job of the session as a page shows it."""

    kind: str = ""
    """'identify' or 'report'."""
    phase: str = IDLE
    place: int | None = None
    """In the queue, 1 is next."""
    stage: str = ""
    text: str = ""
    done: int = 0
    total: int | None = None
    sentence: str = ""
    """Why it failed."""
    history: Mapping[str, tuple[Generation, ...]] = field(default_factory=dict)
    """The generations of each fit as far as they were told; the newest with its population."""

    @property
    def busy(self) -> bool:
        """Whether the job waits or runs."""
        return self.phase in BUSY

    @property
    def share(self) -> float | None:
        """Of the current stage that is done, 0 to 1; None where nobody knows."""
        return min(self.done / self.total, 1.0) if self.total else None

    def after(self, event: Event) -> RunState:
        """The record once the event has happened."""
        step = _STEPS.get(type(event))
        return self if step is None else step(self, event)


def _generation(run: RunState, event: Any) -> RunState:
    """Of the populations only the newest is drawn; thousands of them would stay in memory."""
    generations = run.history.get(event.label, ())
    before = (*generations[:-1], *(replace(last, population=None) for last in generations[-1:]))
    return replace(run, history={**run.history, event.label: (*before, event.generation)})


def _phase(phase: str) -> Callable[[RunState, Any], RunState]:
    return lambda run, event: replace(run, phase=phase, place=None)


def _bad(phase: str) -> Callable[[RunState, Any], RunState]:
    return lambda run, event: replace(run, phase=phase, place=None, sentence=event.sentence)


_STEPS: dict[type[Event], Callable[[RunState, Any], RunState]] = {
    Queued: lambda run, event: replace(run, phase=QUEUED, place=event.place),
    Started: _phase(RUNNING),
    Paused: _phase(PAUSED),
    Resumed: _phase(RUNNING),
    Stage: lambda run, event: replace(run, stage=event.title, total=event.total, done=0, text=""),
    Advanced: lambda run, event: replace(run, done=run.done + event.n, text=event.text or run.text),
    NewGeneration: _generation,
    Finished: _phase(DONE),
    Stopped: _phase(STOPPED),
    Failed: _bad(FAILED),
    WorkerLost: _bad(LOST),
}


PAPER_POINT = 1e-3
"""rad: as near to k pi/8 as a person types it."""


def candidates(model: Model) -> dict[str, Parameter]:
    """Parameters that can be estimated, by name; those of a single segment come last."""
    known = {name: p for name, p in model.parameters.items() if p.lower < p.upper}
    return dict(sorted(known.items(), key=lambda item: item[0][-1:].isdigit()))


def stated(scenario: Scenario, model: Model) -> tuple[Parameter, ...]:
    """The searched parameters with the scenario's bounds."""
    spec, known = scenario.identify, model.parameters
    found = []
    for name in spec.parameters:
        if name.startswith((OFFSET, GAIN, START)) or name not in known:
            continue
        p = known[name]
        lower, upper = spec.bounds.get(name, (p.lower, p.upper))
        value = min(max(spec.start.get(name, p.value), lower), upper)
        found.append(replace(p, value=value, lower=lower, upper=upper))
    return tuple(found)


def paper_points(scenario: Scenario) -> tuple[float, ...] | None:
    """Working points in rad where the scenario is the paper's experiment; None where it is not."""
    if scenario.arm.preset != "paper" or set(scenario.identify.parameters) != {"epsilon", "d"}:
        return None
    points = [
        spec.simulate.theta2
        for spec in scenario.recordings
        if spec.role == "estimate" and spec.simulate is not None
    ]
    if not points or any(p is None for p in points):
        return None
    sure = [p for p in points if p is not None]
    eighths = [8.0 * p / math.pi for p in sure]
    near = all(abs(e - round(e)) * math.pi / 8.0 < PAPER_POINT for e in eighths)
    return tuple(sure) if near else None


def noisy(scenario: Scenario) -> bool:
    """Whether the simulated experiments have noise."""
    return any(
        s.simulate is not None and s.simulate.snr_db is not None for s in scenario.recordings
    )
