"""How the running job stands, as one record that events turn into the next."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from core.results import Generation
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
class Run:
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

    def after(self, event: Event) -> Run:
        """The record once the event has happened."""
        step = _STEPS.get(type(event))
        return self if step is None else step(self, event)


def _generation(run: Run, event: Any) -> Run:
    """Of the populations only the newest is drawn; thousands of them would stay in memory."""
    told = run.history.get(event.label, ())
    before = (*told[:-1], *(replace(last, population=None) for last in told[-1:]))
    return replace(run, history={**run.history, event.label: (*before, event.generation)})


def _phase(phase: str) -> Callable[[Run, Any], Run]:
    return lambda run, event: replace(run, phase=phase, place=None)


def _bad(phase: str) -> Callable[[Run, Any], Run]:
    return lambda run, event: replace(run, phase=phase, place=None, sentence=event.sentence)


_STEPS: dict[type[Event], Callable[[Run, Any], Run]] = {
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
