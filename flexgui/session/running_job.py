"""The one background job of a session: starts, pauses, stops it and follows its events."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from flexgui.core.errors import InputError
from flexgui.jobs import Event, Finished, Job, Task
from flexgui.jobs.job import FAILED, LOST, QUEUED, JobState
from flexgui.jobs.messages import Ended
from flexgui.session.state import PagePart, Topic

if TYPE_CHECKING:
    from flexgui.session.session import Session

AfterEnd = Callable[[], object] | None
"""Called after the end of a job was handled; it may start the next job."""


class RunningJob:
    """One job at a time; a stopped job never leaves a worse result than before."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.state = JobState()
        self.job: Job | None = None
        self._number = 0
        self._last_ended = 0
        """Number of the last job whose end was handled completely."""
        self.start_lock = threading.RLock()
        """Held while a job starts: of two at the same moment one is refused."""

    def start_export(self, task: Task, done: Callable[[Any], object], kind: str = "report") -> bool:
        """Makes an export in the pool; `done` gets the result."""

        def on_event(event: Event) -> None:
            if isinstance(event, Finished):
                done(event.result)

        return self.submit(kind, task, on_event)

    def pause(self) -> None:
        """Pauses the job."""
        if self.job is not None:
            self.job.pause()

    def resume(self) -> None:
        """Continues a paused job."""
        if self.job is not None:
            self.job.resume()

    def stop(self) -> None:
        """Ends the job with the best result so far."""
        if self.job is not None:
            self.job.stop()

    @property
    def busy(self) -> bool:
        """Whether a job waits or runs, or its result is still being handled: a job that starts in
        between would miss it."""
        job = self.job
        return job is not None and not (job.over and self._last_ended == self._number)

    @property
    def remaining_seconds(self) -> float | None:
        """Seconds of the job's current stage; None without an estimate."""
        return None if self.job is None else self.job.remaining_seconds

    def reset(self) -> None:
        """Stops the job and ignores its events: another scenario was opened."""
        self.stop()
        with self._session.lock:
            self._number += 1
            self.job, self.state = None, JobState()

    def submit(self, kind: str, task: Task, on_event: Callable[[Event], AfterEnd]) -> bool:
        """Starts a job; shows a message and returns False where one runs already.

        `more` hears each event; what it returns of the last one follows once that is over.
        """
        try:
            with self.start_lock, self._session.lock:
                if self.busy:
                    raise InputError("Something is being computed already; stop it or wait.")
                self.state = JobState(kind=kind, phase=QUEUED)
                self._number += 1
                number = self._number

                def relay(event: Event) -> None:
                    if number == self._number:
                        self._handle(number, event, on_event)

                self.job = self._session.services.pool.submit(self._session.key, task, relay)
        except InputError as error:
            return self._session.refuse(error)
        self._session.notify(Topic.RUN)
        return True

    def _handle(self, number: int, event: Event, on_event: Callable[[Event], AfterEnd]) -> None:
        after_end: AfterEnd = None
        with self._session.faults.watch(PagePart.RESULT):
            self._update(event)
            after_end = on_event(event)
        if not isinstance(event, Ended):
            return
        with self.start_lock:  # or who comes at the same moment is the next
            self._last_ended = max(self._last_ended, number)
            if after_end is not None:
                after_end()
        self._session.notify(Topic.RUN)

    def _update(self, event: Event) -> None:
        with self._session.changing(Topic.RUN):
            run = self.state = self.state.after(event)
        if run.phase in (FAILED, LOST):
            self._session.show_message(run.sentence, bad=True)
