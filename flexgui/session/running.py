"""The session's job in the pool, and two of its kinds: identification, and its report."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from core.errors import InputError
from core.results import Outcome
from core.scenario.read import scenario_toml
from core.scenario.schema import Scenario
from flexgui.jobs import Event, Finished, Job, Stopped, Task
from flexgui.jobs.events import Ended
from flexgui.jobs.tasks.direct import export, identify
from flexgui.session.edit import edited, put
from flexgui.session.playing import Playing
from flexgui.session.run import FAILED, LOST, QUEUED, STOPPING, Run
from flexgui.session.services import Services
from flexgui.session.topics import Topic


class Running(Playing, ABC):
    """One job at a time; what it leaves when it is stopped is never worse than before."""

    def __init__(self, key: str, folder: Path) -> None:
        super().__init__(key, folder)
        self.run = Run()
        self.job: Job | None = None
        self._run_number = 0

    def identify(self, services: Services, then: Callable[[], object] | None = None) -> bool:
        """Runs the scenario in the pool; `then` follows however it ends."""
        scenario = self.scenario
        # What is missing is looked for at a stage of its own.
        plain = edited(scenario, put(("diagnose",), None))
        arguments = {"scenario_toml": scenario_toml(plain), "folder": str(self.folder)}
        task = Task.of(identify, "The identification", **arguments)

        def on_event(event: Event) -> None:
            self._identified(event, scenario)
            if then is not None and isinstance(event, Ended):
                then()

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
            self.show_message("There is no result yet; identify first.", bad=True)
            return False
        out = self.folder / "export"
        outcome = self._complete_outcome(outcome)
        text = scenario_toml(scenario)
        where = {"folder": str(self.folder), "out": str(out)}
        task = Task.of(export, "The report", outcome=outcome, scenario_toml=text, **where)

        def on_event(event: Event) -> None:
            if isinstance(event, Finished):
                done(out)

        return self._submit(services, "report", task, on_event)

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
        """Whether a job waits or runs."""
        return self.job is not None and not self.job.over

    @property
    def remaining_seconds(self) -> float | None:
        """Of the job's stage."""
        return None if self.job is None else self.job.remaining_seconds

    def forget_job(self) -> None:
        """Stops the job and hears nothing more of it: its scenario has been left."""
        self.stop()
        with self._lock:
            self._run_number += 1
            self.job, self.run = None, Run()

    def _submit(
        self, services: Services, kind: str, task: Task, more: Callable[[Event], None]
    ) -> bool:
        try:
            with self._lock:
                if self.busy:
                    raise InputError("Something is being computed already; stop it or wait.")
                self.run = Run(kind=kind, phase=QUEUED)
                self._run_number += 1
                number = self._run_number

                def relay(event: Event) -> None:
                    if number == self._run_number:
                        self._heard(event)
                        more(event)

                self.job = services.pool.submit(self.key, task, relay)
        except InputError as error:
            self.show_message(str(error), bad=True)
            return False
        self.notify(Topic.RUN)
        return True

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
