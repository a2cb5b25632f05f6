"""The paper's Monte Carlo study of the session's scenario, shown while it comes: a light thread
hands its cases out and takes in what they found."""

from __future__ import annotations

import logging
import shutil
import threading
import time
from abc import ABC
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flexgui.classroom.challenging import Challenging
from flexgui.core.errors import InputError
from flexgui.core.montecarlo.settings import StudySettings
from flexgui.core.resumable.executor import Executor, Here
from flexgui.core.resumable.journal import Finished as FinishedCase
from flexgui.core.resumable.journal import Journal, Record
from flexgui.core.scenario.schema import Scenario
from flexgui.jobs import Event, Finished, Task
from flexgui.places import is_kept, without_places
from flexgui.session.latest import LatestWins
from flexgui.session.services import Services
from flexgui.session.state import Part, Topic
from flexgui.stages.study.executor import QueueExecutor
from flexgui.stages.study.state import (
    DONE,
    FAILED,
    RUNNING,
    STOPPED,
    STOPPING,
    StudyChoice,
    StudyState,
    asked,
    refusal,
    remaining,
    shown,
)
from flexgui.stages.study.task import JOURNAL, study_report

if TYPE_CHECKING:
    from flexgui.core.montecarlo.study import Case

CALM = 1.0
"""s between two drawings of the results."""

SHARE = 5.0
"""Rests at least so many times as long as a drawing took: others want to be served, too."""


class Studying(Challenging, ABC):
    """One study at a time, beside whatever else is computed: its cases are jobs like all others.

    What is finished lies in the session's folder, one journal per scenario, and is not done again.
    """

    def __init__(self, key: str, folder: Path) -> None:
        super().__init__(key, folder)
        self.study_choice = StudyChoice()
        self.study = StudyState()
        self._study_run: StudyRun | None = None
        self._study_left: StudyRun | None = None
        """The run before this one, of a scenario that has been left."""
        self._study_worker = LatestWins(self.faults, Part.STUDY)
        self._study_over = threading.Event()
        self._refused: tuple[Scenario, str] | None = None

    @property
    def study_refusal(self) -> str:
        """Why the scenario cannot be studied; empty where it can."""
        scenario, known = self.scenario, self._refused
        if known is None or known[0] is not scenario:
            known = self._refused = (scenario, refusal(scenario))
        return known[1]

    def choose_study(self, **changes: Any) -> bool:
        """How much of it; False while one is under way."""
        with self._lock:
            if self.study.busy:
                return False
            self.study_choice = replace(self.study_choice, **changes)
        self.notify(Topic.STUDY)
        return True

    def start_study(self, services: Services) -> bool:
        """Begins, or goes on with what is missing; says why where it cannot."""
        executor = QueueExecutor(services.pool, self.key, self.study_choice.at_once)
        try:
            run, left = self._new_study(self.scenario, executor, self._study_changed)
        except InputError as error:
            self.show_message(str(error), bad=True)
            return False
        run.start(after=left)
        self.notify(Topic.STUDY)
        return True

    def _recall_study(self, scenario: Scenario) -> None:
        """Shows what the session's folder holds of a study of the scenario; computes nothing."""
        try:
            run, left = self._new_study(scenario, Here(), self._show_study)
        except InputError as error:  # another version refuses it
            self.study = StudyState(FAILED, sentence=str(error))
            return
        run.stop()
        run.start(after=left)

    def _new_study(
        self, scenario: Scenario, executor: Executor, on_change: Callable[[StudyRun], object]
    ) -> tuple[StudyRun, StudyRun | None]:
        """A run that is not started, and the one before it, which may still write."""
        with self._lock:
            if self.study.busy:
                raise InputError("The study is under way already; stop it or wait.")
            settings = asked(scenario, self.study_choice)
            known = self.study.settings
            same = known is not None and known.identity == settings.identity
            folder = self.folder / "studies" / settings.identity
            run = StudyRun(settings, self.study_choice.parts, executor, folder, on_change)
            left, self._study_run = self._study_run or self._study_left, run
            sections = self.study.sections if same else ()
            self.study = replace(_state(run), sections=sections)
        return run, left

    def stop_study(self) -> None:
        """What is finished stays, and the next start goes on from there."""
        with self._lock:
            run = self._study_run
            if run is None or not self.study.busy:
                return
            run.stop()
            self.study = replace(self.study, phase=run.phase)
        self.notify(Topic.STUDY)

    def forget_study(self) -> None:
        """Stops it and hears nothing more of it: its scenario has been left."""
        with self._lock:
            run, self._study_run = self._study_run, None
            self._study_left = run or self._study_left
            self.study = StudyState()
        if run is not None:
            run.stop()
        self.notify(Topic.STUDY)

    def end_study(self) -> None:
        """The session ends: nothing is drawn any more."""
        self._study_over.set()
        self.forget_study()
        self._study_worker.close()

    def export_study(self, services: Services, done: Callable[[Path], None]) -> bool:
        """Writes the report of what there is, in the pool; `done` gets its folder."""
        run = self._study_run
        if run is None or not run.records:
            self.show_message("There are no results of a study yet; start one first.", bad=True)
            return False
        task = Task.of(
            study_report, "The report of the study", settings=run.settings.model_dump_json(),
            folder=str(run.folder),
        )  # fmt: skip

        def on_event(event: Event) -> None:
            if isinstance(event, Finished):
                done(run.folder)

        return self._submit(services, "study report", task, on_event)

    def _study_changed(self, run: StudyRun) -> None:
        if not self._show_study(run):
            return
        if run.phase == FAILED:
            self.show_message(run.sentence, bad=True)
        elif run.phase == STOPPED:
            self.show_message("The study was stopped; what is finished is kept.")

    def _show_study(self, run: StudyRun) -> bool:
        """False where another one, or none, is shown."""
        if self.closed and not is_kept(self.folder):
            # A run that was just beginning has made its folder anew.
            shutil.rmtree(self.folder, ignore_errors=True)
        with self._lock:
            if run is not self._study_run:
                return False
            self.study = replace(_state(run), sections=self.study.sections)
        self.notify(Topic.STUDY)
        self._study_worker.ask(lambda: self._draw_study(run))
        return True

    def _draw_study(self, run: StudyRun) -> None:
        """On a thread of its own, and not too often; the newest results win."""
        from flexgui.core.montecarlo.summary import summarise

        records = run.records
        if run is not self._study_run or not records:
            return
        begun = time.monotonic()
        sections = shown(summarise(run.settings, records))
        took = time.monotonic() - begun
        with self._lock:
            if run is not self._study_run:
                return
            self.study = replace(self.study, sections=sections)
        self.notify(Topic.STUDY)
        self._study_over.wait(max(CALM, SHARE * took))


def _state(run: StudyRun) -> StudyState:
    return StudyState(
        run.phase, run.settings, run.parts, run.done, run.total, run.before,
        run.remaining_seconds, without_places(run.sentence, run.folder),
    )  # fmt: skip


log = logging.getLogger(__name__)

LONGEST_WAIT = 15.0
"""s for the thread to end where somebody waits for it: more than a pool's patience."""


class StudyRun:
    """Thread-safe. Calls `on_change` after each case and at the end, on its own thread."""

    def __init__(
        self,
        settings: StudySettings,
        parts: tuple[str, ...],
        executor: Executor,
        folder: Path,
        on_change: Callable[[StudyRun], object],
    ) -> None:
        from flexgui.core.montecarlo.study import study_cases

        self.settings, self.folder, self.phase, self.sentence = settings, folder, RUNNING, ""
        self.done = self.before = 0
        self.parts, self._executor, self._on_change = parts, executor, on_change
        self._cases: list[Case] = study_cases(settings, parts)
        self._records: dict[str, Record] = {}
        self._new: list[str] = []
        self._after: StudyRun | None = None
        self._begun = time.monotonic()
        self._lock, self._stop = threading.Lock(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="study", daemon=True)

    def start(self, after: StudyRun | None = None) -> None:
        """Returns at once; `after` may still write into the same folder and is waited for."""
        self._after = after
        self._thread.start()

    def stop(self) -> None:
        """Begins no other case; returns at once."""
        with self._lock:
            if self.phase == RUNNING:
                self.phase = STOPPING
        self._stop.set()

    def wait(self, timeout: float = LONGEST_WAIT) -> bool:
        """Whether its thread has ended in time; for the next run, tests and scripts."""
        self._thread.join(timeout)
        return not self._thread.is_alive()

    @property
    def total(self) -> int:
        """Number of cases."""
        return len(self._cases)

    @property
    def records(self) -> dict[str, Record]:
        """All that is known of this study, also of parts that were not asked for now."""
        with self._lock:
            return dict(self._records)

    @property
    def remaining_seconds(self) -> float | None:
        """s that the rest may take; None where nobody knows yet."""
        with self._lock:
            left = [case.part for case in self._cases if case.key not in self._records]
            elapsed = time.monotonic() - self._begun
            return remaining(self._records, self._new, left, elapsed)

    def _run(self) -> None:
        try:
            self._go_through()
            self._end(DONE if self.done == self.total else STOPPED)
        except InputError as error:
            self._end(FAILED, str(error))
        except Exception as error:
            log.exception("A study failed")
            kind = type(error).__name__
            self._end(FAILED, f"The study failed unexpectedly ({kind}); details are in the log.")
        self._on_change(self)

    def _go_through(self) -> None:
        from flexgui.core.montecarlo.study import study

        if self._after is not None:
            self._after.wait()
            self._after = None
        path = self.folder / JOURNAL
        with self._lock:
            self._records = dict(Journal(path, self.settings.identity).records)
        steps = study(
            self.settings, executor=self._executor, path=path, only=self.parts,
            stop=self._stop.is_set,
        )  # fmt: skip
        for step in steps:
            self._take(step)

    def _take(self, step: FinishedCase) -> None:
        key = step.record["key"]
        with self._lock:
            self.done = step.done
            self._records[key] = step.record
            if step.before:
                self.before, self._begun = step.done, time.monotonic()
            else:
                self._new.append(key)
        if not step.before or step.done == step.total:
            self._on_change(self)

    def _end(self, phase: str, sentence: str = "") -> None:
        with self._lock:
            self.phase, self.sentence = phase, sentence
