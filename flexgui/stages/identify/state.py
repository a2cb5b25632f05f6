"""The identification, and the last good result."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from flexgui.core.diagnosed_scenario import identified_scenario
from flexgui.core.identify.first_states import START
from flexgui.core.identify.unknowns import GAIN, OFFSET
from flexgui.core.model import Model
from flexgui.core.parameters import Parameter
from flexgui.core.results import Outcome, Profile, RecordingComparison
from flexgui.core.scenario.schema import Scenario
from flexgui.jobs import Event, Partial, Stopped, Task
from flexgui.session.running_job import AfterEnd
from flexgui.session.state import Topic
from flexgui.stages.identify.task import identify, profile

if TYPE_CHECKING:
    from flexgui.session.session import Session


@dataclass(frozen=True)
class SoFar:
    """What a fit has come to while it runs."""

    comparison: RecordingComparison | None = None
    costs: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    """Label of the fit -> mean squares, in the order of their steps."""

    def after(self, label: str, cost: float, comparison: RecordingComparison) -> SoFar:
        """With one more `cost`."""
        costs = (*self.costs.get(label, ()), cost)
        return SoFar(comparison, {**self.costs, label: costs})


class Identification:
    """What was identified last, of which scenario; all earlier results are kept with the models."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.reset()

    def reset(self) -> None:
        """Another scenario follows."""
        self.outcome: Outcome | None = None
        """The last good result."""
        self.outcome_of: Scenario | None = None
        self.so_far = SoFar()
        """Of the fit that runs, or ran last."""
        self.profile: Profile | None = None
        """Of the last result, of the parameter that was asked for last."""

    @property
    def current(self) -> Outcome | None:
        """The result, where it is of the scenario as it is now."""
        return self.outcome if self.outcome_of == self._session.document.scenario else None

    def take(
        self, outcome: Outcome | None, of: Scenario | None, profile: Profile | None = None
    ) -> None:
        """Another result, of the scenario `of`; the caller lets the subscribers know."""
        with self._session.lock:
            if outcome is not self.outcome or profile is not None:
                self.profile = profile
            self.outcome, self.outcome_of = outcome, of
            if outcome is not None and of is not None:
                self._session.diagnosis.models.identified(of, outcome, self.profile)

    def start(self, then: AfterEnd = None) -> bool:
        """Runs the scenario in the pool; `then` follows however it ends."""
        scenario = self._session.document.scenario
        arguments = {"scenario": scenario, "folder": str(self._session.folder)}
        task = Task.of(identify, "The identification", **arguments)
        self.so_far = SoFar()

        def on_event(event: Event) -> AfterEnd:
            self._identified(event, scenario)
            return then

        return self._session.run.submit("identify", task, on_event)

    def find_profile(self, name: str, recording: str | None) -> bool:
        """Holds a parameter of the last result beside its estimate, in the pool; `recording`: the
        one that was fitted alone."""
        outcome, scenario = self.outcome, self.outcome_of
        if outcome is None or scenario is None:
            return False
        task = Task.of(
            profile, f"The profile of {name}", scenario=identified_scenario(scenario, outcome),
            name=name, recording=recording, folder=str(self._session.folder),
        )  # fmt: skip

        def show(found: Profile) -> None:
            with self._session.changing(Topic.OUTCOME):
                if self.outcome is outcome:
                    self.take(outcome, scenario, found)
                else:  # of another one by now, with which it is shown again
                    self._session.diagnosis.models.identified(scenario, outcome, found)

        return self._session.run.start_export(task, show, "profile")

    def _identified(self, event: Event, scenario: Scenario) -> None:
        if isinstance(event, Partial):
            with self._session.changing(Topic.RUN):
                self.so_far = self.so_far.after(*event.value)
            return
        outcome = getattr(event, "result", None)
        if not isinstance(outcome, Outcome):
            return
        if isinstance(event, Stopped) and self.outcome is not None:
            self._session.show_message("Stopped; the last complete result is kept.")
            return
        self.take(outcome, scenario)
        self._session.notify(Topic.OUTCOME)
        if isinstance(event, Stopped):
            self._session.show_message("Stopped; this is the best result so far.")
        self._session.playback.refresh()


PAPER_POINT = 1e-3
"""rad: as near to k pi/8 as a person types it."""


def candidates(model: Model) -> dict[str, Parameter]:
    """Parameters that can be estimated, by name; those of a single segment come last."""
    bounded = {name: p for name, p in model.parameters.items() if p.lower < p.upper}
    return dict(sorted(bounded.items(), key=lambda item: item[0][-1:].isdigit()))


def stated(scenario: Scenario, model: Model) -> tuple[Parameter, ...]:
    """The searched parameters with the scenario's bounds."""
    spec, nominal = scenario.identify, model.parameters
    names = []
    for name in spec.parameters:
        if name.startswith((OFFSET, GAIN, START)) or name not in nominal:
            continue
        p = nominal[name]
        lower, upper = spec.bounds.get(name, (p.lower, p.upper))
        value = min(max(spec.start.get(name, p.value), lower), upper)
        names.append(replace(p, value=value, lower=lower, upper=upper))
    return tuple(names)


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
    indices = [p for p in points if p is not None]
    eighths = [8.0 * p / math.pi for p in indices]
    near = all(abs(e - round(e)) * math.pi / 8.0 < PAPER_POINT for e in eighths)
    return tuple(indices) if near else None


def noisy(scenario: Scenario) -> bool:
    """Whether the simulated experiments have noise."""
    return any(
        s.simulate is not None and s.simulate.snr_db is not None for s in scenario.recordings
    )
