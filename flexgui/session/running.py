"""Jobs of a session in the pool: identification, its report, looks at the models of the way."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from flexgui.core.errors import InputError
from flexgui.core.results import MISSING, Estimate, LinearModel, Outcome, RecordingComparison
from flexgui.core.scenario.read import scenario_toml
from flexgui.core.scenario.schema import Scenario
from flexgui.jobs import Event, Finished, Job, Stopped, Task
from flexgui.jobs.events import Ended
from flexgui.jobs.tasks.direct import export, identify, plan_next
from flexgui.session.edit import Document, edited, put
from flexgui.session.error_maps import WhereItFails, where_it_fails
from flexgui.session.look import Look, ladder_steps, story
from flexgui.session.playing import Playing
from flexgui.session.run_state import FAILED, LOST, QUEUED, STOPPING, Run
from flexgui.session.services import Services
from flexgui.session.state import Part, Topic
from flexgui.views.pooled import overall_estimates

Then = Callable[[], object] | None
"""What is begun once the end of a job is taken over."""


class Running(Playing, ABC):
    """One job at a time; what it leaves when it is stopped is never worse than before."""

    def __init__(self, key: str, folder: Path) -> None:
        super().__init__(key, folder)
        self.run = Run()
        self.job: Job | None = None
        self.planned: tuple[str, ...] = ()
        """What the last plan of the next experiments says, a paragraph each."""
        self._run_number = 0
        self._settled = 0
        """The last of the runs whose end was heard to the last word."""
        self._beginning = threading.RLock()
        """Held while a job is begun: of two at the same moment one is refused."""

    def identify(self, services: Services, then: Then = None) -> bool:
        """Runs the scenario in the pool; `then` follows however it ends."""
        scenario = self.scenario
        # What is missing is looked for at a stage of its own.
        plain = edited(scenario, put(("diagnose",), None))
        arguments = {"scenario_toml": scenario_toml(plain), "folder": str(self.folder)}
        task = Task.of(identify, "The identification", **arguments)

        def on_event(event: Event) -> Then:
            self._identified(event, scenario)
            return then

        return self._submit(services, "identify", task, on_event)

    def _identified(self, event: Event, scenario: Scenario) -> None:
        found = getattr(event, "result", None)
        if not isinstance(found, Outcome):
            return
        if isinstance(event, Stopped) and self.outcome is not None:
            self.show_message("Stopped; the last complete result is kept.")
            return
        with self._lock:
            self.outcome, self.outcome_of = found, scenario
        self.notify(Topic.OUTCOME)
        if isinstance(event, Stopped):
            self.show_message("Stopped; the best found so far is shown.")
        self.refresh_playback()

    @abstractmethod
    def _complete_outcome(self, outcome: Outcome) -> Outcome:
        """The last result with what was found missing and added on the way to it."""

    def report(self, services: Services, done: Callable[[Path], None]) -> bool:
        """Writes the export of the last result in the pool; `done` gets its folder."""
        outcome, scenario = self.outcome, self.outcome_of
        if outcome is None or scenario is None:
            return self.refuse("There is no result yet; identify first.")
        out = self.folder / "export"
        outcome = self._complete_outcome(outcome)
        text = scenario_toml(scenario)
        where = {"folder": str(self.folder), "out": str(out)}
        task = Task.of(export, "The report", outcome=outcome, scenario_toml=text, **where)
        return self.make(services, task, lambda _: done(out))

    def make(self, services: Services, task: Task, done: Callable[[Any], object]) -> bool:
        """Makes something to take away in the pool; `done` gets it."""

        def on_event(event: Event) -> None:
            if isinstance(event, Finished):
                done(event.result)

        return self._submit(services, "report", task, on_event)

    def plan_next(
        self, services: Services, seconds: float, limits: Document, done: Callable[[Path], None]
    ) -> bool:
        """Plans the next experiments in the pool; `done` gets the folder of their files.

        `limits` are a scenario's `[limits]`; a wrong one is said.
        """
        try:
            plain = edited(self.scenario, put(("limits",), limits or None))
        except InputError as error:
            return self.refuse(error)
        out = self.folder / "plan"
        where = {"folder": str(self.folder), "out": str(out)}
        text = scenario_toml(plain)
        task = Task.of(plan_next, "The plan", scenario_toml=text, seconds=seconds, **where)

        def on_event(event: Event) -> None:
            found = getattr(event, "result", None)
            if isinstance(event, Finished) and isinstance(found, tuple):
                with self._lock:
                    self.planned = found
                self.notify(Topic.OUTCOME)
                done(out)

        return self._submit(services, "plan", task, on_event)

    def pause(self) -> None:
        """Holds the job."""
        if self.job is not None:
            self.job.pause()

    def resume(self) -> None:
        """Lets it go on."""
        if self.job is not None:
            self.job.resume()

    def stop(self) -> None:
        """Ends the job with the best it has."""
        with self._lock:
            job = self.job
            if job is None or job.over:
                return
            self.run = replace(self.run, phase=STOPPING)
        self.notify(Topic.RUN)
        job.stop()

    @property
    def busy(self) -> bool:
        """Whether a job waits or runs, or what it found is being taken over: who began the next
        one in between would never see it."""
        job = self.job
        return job is not None and not (job.over and self._settled == self._run_number)

    @property
    def remaining_seconds(self) -> float | None:
        """Of the job's stage."""
        return None if self.job is None else self.job.remaining_seconds

    def forget_job(self) -> None:
        """Stops the job and hears nothing more of it: its scenario has been left."""
        self.stop()
        with self._lock:
            self._run_number += 1
            self.job, self.run, self.planned = None, Run(), ()

    def _submit(
        self, services: Services, kind: str, task: Task, more: Callable[[Event], Then]
    ) -> bool:
        """`more` hears each event; what it returns of the last one follows once that is over."""
        try:
            with self._beginning, self._lock:
                if self.busy:
                    raise InputError("Something is being computed already; stop it or wait.")
                self.run = Run(kind=kind, phase=QUEUED)
                self._run_number += 1
                number = self._run_number

                def relay(event: Event) -> None:
                    if number == self._run_number:
                        self._take_over(number, event, more)

                self.job = services.pool.submit(self.key, task, relay)
        except InputError as error:
            return self.refuse(error)
        self.notify(Topic.RUN)
        return True

    def _take_over(self, number: int, event: Event, more: Callable[[Event], Then]) -> None:
        then: Then = None
        with self.faults.watch(Part.RESULT):
            self._heard(event)
            then = more(event)
        if not isinstance(event, Ended):
            return
        with self._beginning:  # or who comes at the same moment is the next
            self._settled = max(self._settled, number)
            if then is not None:
                then()
        self.notify(Topic.RUN)

    def _heard(self, event: Event) -> None:
        with self._lock:
            stopping = self.run.phase == STOPPING
            self.run = self.run.after(event)
            if stopping and self.run.busy:
                self.run = replace(self.run, phase=STOPPING)
            run = self.run
        self.notify(Topic.RUN)
        if run.phase in (FAILED, LOST):
            self.show_message(run.sentence, bad=True)


COMPARED_BY = (
    "Measurement and model are compared as in the diagnosis: the initial state of each recording "
    "is fitted too, so that all figures agree with the error ladder."
)


class Comparing(Running, ABC):
    """Ladder, maps and signals come from one fit, so that they agree."""

    def __init__(self, key: str, folder: Path) -> None:
        super().__init__(key, folder)
        self.looks: tuple[Look, ...] = ()
        """The way so far, each step complete or stopped by the person."""
        self.pending: Look | None = None
        """What the worker looks at now."""
        self._failing: WhereItFails | None = None
        self._scale: tuple[object, float] = (None, 1.0)

    @property
    def shown_looks(self) -> tuple[Look, ...]:
        """The way with what the worker has told so far."""
        if self.pending is None or self.pending.found is None:
            return self.looks
        return (*self._before(self.pending), self.pending)

    @property
    def look(self) -> Look | None:
        """The newest of them."""
        return next(reversed(self.shown_looks), None)

    @property
    def comparisons(self) -> tuple[RecordingComparison, ...]:
        """Measured against modelled: by the look's fit where there is one of the newest model, so
        that maps, ladder and signals agree; else by the identification."""
        look, outcome = self.look, self.outcome
        fitted = () if outcome is None else outcome.comparisons
        if look is None or not look.comparisons:
            return fitted
        identified_since = look is not self.pending and outcome is not look.outcome
        current = look.scenario == (self.outcome_of or self.scenario) and not identified_since
        return look.comparisons if current or look is self.pending else fitted

    @property
    def floors(self) -> dict[str, float] | None:
        """channel -> floor, those that the ladder stands on; None before anything was looked at."""
        steps = ladder_steps(self.shown_looks)
        return {e.channel: e.floor for e in steps[-1].errors} if steps else None

    @property
    def failing(self) -> WhereItFails | None:
        """Where the model fails, as it is compared now; None where nothing was compared."""
        shown, floors = self.comparisons, self.floors
        known = self._failing
        if known is None or known.comparisons is not shown or known.stated != floors:
            known = where_it_fails(shown, floors) if shown else None
            self._failing = known
        return known

    @property
    def worst_error(self) -> float:
        """What the darkest colour of the arm stands for, in floors: the worst error of the way's
        first look, so that an arm whose error is gone is seen to have lost its colour."""
        first = next(iter(self.shown_looks), None)
        shown = first.comparisons if first is not None and first.comparisons else self.comparisons
        if self._scale[0] is not shown:
            failing = self.failing
            if shown is not self.comparisons or failing is None:
                failing = where_it_fails(shown, self.floors) if shown else None
            traces = () if failing is None else tuple(failing.now.values())
            self._scale = (shown, max([one.worst for one in traces], default=1.0))
        return self._scale[1]

    def _before(self, look: Look) -> tuple[Look, ...]:
        """The steps that stay before this one: all, those to the same model, or none."""
        if look.title and not any(k.scenario == look.scenario for k in self.looks):
            return self.looks
        same = [k for k, each in enumerate(self.looks) if each.scenario == look.scenario]
        return self.looks[: same[-1]] if same else ()

    def _complete_outcome(self, outcome: Outcome) -> Outcome:
        last = self.looks[-1] if self.looks else None
        if last is None or last.scenario != self.outcome_of:
            return outcome
        shown = self.comparisons or outcome.comparisons
        notes = outcome.notes if shown is outcome.comparisons else (*outcome.notes, COMPARED_BY)
        diagnosis = story(self.looks)
        diagnosis = diagnosis and replace(diagnosis, linear_model=self.linear_model)
        given = self.first_fit if diagnosis is not None and diagnosis.added else ()
        return replace(outcome, comparisons=shown, notes=notes, diagnosis=diagnosis, as_given=given)

    @property
    def first_fit(self) -> tuple[Estimate, ...]:
        """Estimates of the way's first model, which the last result may no longer be about."""
        first = next(iter(self.shown_looks), None)
        if first is None:
            return ()
        if first.outcome is not None:
            return overall_estimates(first.outcome.fits)
        return () if first.found is None else first.found.step.parameters

    @property
    def whole(self) -> Outcome | None:
        """The last result with the way to it, as the report tells it."""
        return None if self.outcome is None else self._complete_outcome(self.outcome)

    @property
    def linear_model(self) -> LinearModel | None:
        """What the linear model costs, where the first model of the way was identified with it."""
        from flexgui.core.workbench import linear_model

        first = next(iter(self.shown_looks), None)
        if first is None or first.diagnosis is None or first.outcome is None:
            return None
        if first.outcome.level != "lpv":
            return None
        return linear_model(first.outcome.fits, first.outcome.comparisons, first.diagnosis)

    @property
    def known_biased(self) -> bool:
        """Whether an effect is known to be missing in the model of the last result."""
        same = [look.diagnosis for look in self.shown_looks if look.scenario == self.outcome_of]
        return any(found is not None and found.verdict == MISSING for found in same)
