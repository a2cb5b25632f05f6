"""The paper's Monte Carlo study of the session's scenario; a thread distributes its cases."""

from __future__ import annotations

import logging
import shutil
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flexgui.core.errors import InputError
from flexgui.core.montecarlo.settings import StudySettings
from flexgui.core.resumable.executor import Executor, Here, WorkFailedError
from flexgui.core.resumable.journal import Finished as FinishedCase
from flexgui.core.resumable.journal import Journal, Record
from flexgui.core.scenario.schema import Scenario
from flexgui.jobs import Task
from flexgui.jobs.executor import QueueExecutor
from flexgui.places import has_saved_work, hide_paths
from flexgui.session.scheduling import LatestRequest
from flexgui.session.state import PagePart, Topic
from flexgui.stages.study.state import (
    DONE,
    FAILED,
    RUNNING,
    STOPPED,
    STOPPING,
    ShownSection,
    StudyChoice,
    StudyState,
    asked,
    refusal_of,
    remaining,
    shown,
)
from flexgui.stages.study.task import JOURNAL, study_report

if TYPE_CHECKING:
    from flexgui.core.montecarlo.study import Case
    from flexgui.session.session import Session

SHORTEST_PAUSE = 1.0
"""s between two drawings of the results."""

REST_PER_DRAWING = 5.0
"""Rests at least so many times as long as a drawing took: others want to be served, too."""


class Study:
    """One study at a time, beside whatever else is computed: its cases are jobs like all others.

    What is finished lies in the session's folder, one journal per scenario, and is not done again.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self.choice = StudyChoice()
        self.run: StudyRun | None = None
        """The one that is shown."""
        self._left: StudyRun | None = None
        """The run before this one, of a scenario that has been left."""
        self._worker = LatestRequest(session.faults, PagePart.STUDY)
        self._over = threading.Event()
        self._refused: tuple[Scenario, str] | None = None
        self._without_run = StudyState()
        """How it stands without a run: nothing, or why what was kept cannot be shown."""
        self._sections: tuple[ShownSection, ...] = ()

    @property
    def state(self) -> StudyState:
        """How the study stands, with what has been drawn of its results."""
        run = self.run
        return self._without_run if run is None else replace(run.state, sections=self._sections)

    @property
    def refusal(self) -> str:
        """Why the scenario cannot be studied; empty where it can."""
        scenario, cached = self._session.document.scenario, self._refused
        if cached is None or cached[0] is not scenario:
            cached = self._refused = (scenario, refusal_of(scenario))
        return cached[1]

    def choose(self, **changes: Any) -> bool:
        """How much of it; False while one is under way."""
        with self._session.lock:
            if self.state.busy:
                return False
            self.choice = replace(self.choice, **changes)
        self._session.notify(Topic.STUDY)
        return True

    def start(self) -> bool:
        """Begins, or goes on with what is missing; says why where it cannot."""
        executor = QueueExecutor(
            self._session.services.pool, self._session.key, self.choice.at_once
        )
        try:
            run, remaining = self._new(self._session.document.scenario, executor, self._changed)
        except InputError as error:
            return self._session.refuse(error)
        run.start(after=remaining)
        self._session.notify(Topic.STUDY)
        return True

    def recall(self, scenario: Scenario) -> None:
        """Shows what the session's folder holds of a study of the scenario; computes nothing."""
        try:
            run, remaining = self._new(scenario, Here(), self._show)
        except InputError as error:  # another version refuses it
            self._without_run = StudyState(FAILED, sentence=str(error))
            return
        run.stop()
        run.start(after=remaining)

    def _new(
        self, scenario: Scenario, executor: Executor, on_change: Callable[[StudyRun], object]
    ) -> tuple[StudyRun, StudyRun | None]:
        """A run that is not started, and the one before it, which may still write."""
        with self._session.lock:
            if self.state.busy:
                raise InputError("The study is running; stop it or wait.")
            settings = asked(scenario, self.choice)
            previous = self.state.settings
            same = previous is not None and previous.identity == settings.identity
            folder = self._session.folder / "studies" / settings.identity
            run = StudyRun(settings, self.choice.parts, executor, folder, on_change)
            remaining, self.run = self.run or self._left, run
            self._sections = self._sections if same else ()
        return run, remaining

    def stop(self) -> None:
        """What is finished stays, and the next start goes on from there."""
        if self.run is not None and self.run.state.busy:
            self.run.stop()
            self._session.notify(Topic.STUDY)

    def reset(self) -> None:
        """Stops it and hears nothing more of it: its scenario has been left."""
        with self._session.lock:
            run, self.run = self.run, None
            self._left = run or self._left
            self._without_run, self._sections = StudyState(), ()
        if run is not None:
            run.stop()
        self._session.notify(Topic.STUDY)

    def close(self) -> None:
        """The session ends: nothing is drawn any more."""
        self._over.set()
        self.reset()
        self._worker.close()

    def export(self, done: Callable[[Path], None]) -> bool:
        """Writes the report of what there is, in the pool; `done` gets its folder."""
        run = self.run
        if run is None or not run.records:
            return self._session.refuse("The study has no results yet; start it first.")
        task = Task.of(
            study_report, "The report of the study", settings=run.settings.model_dump_json(),
            folder=str(run.folder),
        )  # fmt: skip
        return self._session.run.start_export(task, lambda _: done(run.folder), "study report")

    def _changed(self, run: StudyRun) -> None:
        if not self._show(run):
            return
        if run.state.phase == FAILED:
            self._session.refuse(run.state.sentence)
        elif run.state.phase == STOPPED:
            self._session.show_message("The study was stopped; finished cases are kept.")

    def _show(self, run: StudyRun) -> bool:
        """False where another one, or none, is shown."""
        if self._session.closed and not has_saved_work(self._session.folder):
            # A run that was just beginning has made its folder again.
            shutil.rmtree(self._session.folder, ignore_errors=True)
        if run is not self.run:
            return False
        self._session.notify(Topic.STUDY)
        self._worker.request(lambda: self._draw(run))
        return True

    def _draw(self, run: StudyRun) -> None:
        """On a thread of its own, and not too often; the newest results win."""
        from flexgui.core.montecarlo.summary import summarise

        records = run.records
        if run is not self.run or not records:
            return
        started = time.monotonic()
        sections = shown(summarise(run.settings, records))
        took = time.monotonic() - started
        with self._session.lock:
            if run is not self.run:
                return
            self._sections = sections
        self._session.notify(Topic.STUDY)
        self._over.wait(max(SHORTEST_PAUSE, REST_PER_DRAWING * took))


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

        self.settings, self.folder = settings, folder
        self._executor, self._on_change = executor, on_change
        self._cases: list[Case] = study_cases(settings, parts)
        self._state = StudyState(RUNNING, settings, parts, total=len(self._cases))
        self._records: dict[str, Record] = {}
        self._new: list[str] = []
        self._after: StudyRun | None = None
        self._begun = time.monotonic()
        self._lock, self._stop = threading.RLock(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="study", daemon=True)

    def start(self, after: StudyRun | None = None) -> None:
        """Returns at once; `after` may still write into the same folder and is waited for."""
        self._after = after
        self._thread.start()

    def stop(self) -> None:
        """Begins no other case; returns at once."""
        with self._lock:
            if self._state.phase == RUNNING:
                self._change(phase=STOPPING)
        self._stop.set()

    def wait(self, timeout: float = LONGEST_WAIT) -> bool:
        """Whether its thread has ended within `timeout` in s; for the next run, tests, scripts."""
        self._thread.join(timeout)
        return not self._thread.is_alive()

    @property
    def records(self) -> dict[str, Record]:
        """All that is known of this study, also of parts that were not asked for now."""
        with self._lock:
            return dict(self._records)

    @property
    def state(self) -> StudyState:
        """How it stands now."""
        with self._lock:
            open_parts = [case.part for case in self._cases if case.key not in self._records]
            elapsed = time.monotonic() - self._begun
            seconds = remaining(self._records, self._new, open_parts, elapsed)
            return replace(self._state, remaining_seconds=seconds)

    def _change(self, **changes: Any) -> None:
        with self._lock:
            self._state = replace(self._state, **changes)

    def _run(self) -> None:
        try:
            self._go_through()
            done = self._state.done == self._state.total
            self._change(phase=DONE if done else STOPPED)
        except (InputError, WorkFailedError) as error:
            self._change(phase=FAILED, sentence=hide_paths(str(error), self.folder))
        except Exception as error:
            log.exception("A study failed")
            kind = type(error).__name__
            sentence = f"The study failed unexpectedly ({kind}); details are in the log."
            self._change(phase=FAILED, sentence=sentence)
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
            self.settings, executor=self._executor, path=path, only=self._state.parts,
            stop=self._stop.is_set,
        )  # fmt: skip
        for step in steps:
            self._take(step)

    def _take(self, step: FinishedCase) -> None:
        key = step.record["key"]
        with self._lock:
            self._records[key] = step.record
            self._change(done=step.done, before=step.done if step.before else self._state.before)
            if step.before:
                self._begun = time.monotonic()
            else:
                self._new.append(key)
        if not step.before or step.done == step.total:
            self._on_change(self)
