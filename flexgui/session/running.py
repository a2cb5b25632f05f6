"""Jobs of a session in the pool: identification, its report, looks at the models of the way."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from flexgui.core.errors import InputError
from flexgui.core.results import Outcome
from flexgui.core.scenario.read import scenario_toml
from flexgui.core.scenario.schema import Scenario
from flexgui.jobs import Event, Finished, Job, Stopped, Task
from flexgui.jobs.events import Ended
from flexgui.session.edit import Document, edited, put
from flexgui.session.playing import Playing
from flexgui.session.run_state import FAILED, LOST, QUEUED, STOPPING, Run
from flexgui.session.services import Services
from flexgui.session.state import Part, Topic
from flexgui.stages.export.task import export, plan_next
from flexgui.stages.identify.task import identify

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
