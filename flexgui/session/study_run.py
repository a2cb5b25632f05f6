"""One study under way: a light thread hands its cases out and takes in what they found."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from pathlib import Path

from core.errors import InputError
from core.montecarlo.settings import StudySettings
from core.montecarlo.study import Case, study, study_cases
from core.resumable.executor import Executor
from core.resumable.journal import Finished, Journal, Record
from flexgui.jobs.tasks.direct import JOURNAL
from flexgui.session.study_state import DONE, FAILED, RUNNING, STOPPED, STOPPING, remaining

log = logging.getLogger(__name__)

LONGEST_WAIT = 15.0
"""s for the thread to end where somebody waits for it: more than a pool's patience."""


class StudyRun:
    """Thread-safe. Calls `told` after each case and at the end, on its own thread."""

    def __init__(
        self,
        settings: StudySettings,
        parts: tuple[str, ...],
        executor: Executor,
        folder: Path,
        told: Callable[[StudyRun], None],
    ) -> None:
        self.settings, self.folder, self.phase, self.sentence = settings, folder, RUNNING, ""
        self.done = self.before = 0
        self.parts, self._executor, self._told = parts, executor, told
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
        self._told(self)

    def _go_through(self) -> None:
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

    def _take(self, step: Finished) -> None:
        key = step.record["key"]
        with self._lock:
            self.done = step.done
            self._records[key] = step.record
            if step.before:
                self.before, self._begun = step.done, time.monotonic()
            else:
                self._new.append(key)
        if not step.before or step.done == step.total:
            self._told(self)

    def _end(self, phase: str, sentence: str = "") -> None:
        with self._lock:
            self.phase, self.sentence = phase, sentence
