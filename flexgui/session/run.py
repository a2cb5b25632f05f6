"""The one job of a session that a person waits for."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from flexgui.core.errors import InputError
from flexgui.jobs import Event, Finished, Job, Task
from flexgui.jobs.job import FAILED, LOST, QUEUED, JobState
from flexgui.jobs.messages import Ended
from flexgui.session.state import Part, Topic

if TYPE_CHECKING:
    from flexgui.session.session import Session

Then = Callable[[], object] | None
"""What is begun once the end of a job is taken over."""


class Run:
    """One job at a time; what it leaves when it is stopped is never worse than before."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self.state = JobState()
        self.job: Job | None = None
        self._number = 0
        self._settled = 0
        """The last of the runs whose end was heard to the last word."""
        self.beginning = threading.RLock()
        """Held while a job is begun: of two at the same moment one is refused."""

    def make(self, task: Task, done: Callable[[Any], object]) -> bool:
        """Makes something to take away in the pool; `done` gets it."""

        def on_event(event: Event) -> None:
            if isinstance(event, Finished):
                done(event.result)

        return self.submit("report", task, on_event)

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
        if self.job is not None:
            self.job.stop()

    @property
    def busy(self) -> bool:
        """Whether a job waits or runs, or what it found is being taken over: who began the next
        one in between would never see it."""
        job = self.job
        return job is not None and not (job.over and self._settled == self._number)

    @property
    def remaining_seconds(self) -> float | None:
        """Of the job's stage."""
        return None if self.job is None else self.job.remaining_seconds

    def forget(self) -> None:
        """Stops the job and hears nothing more of it: its scenario has been left."""
        self.stop()
        with self._session.lock:
            self._number += 1
            self.job, self.state = None, JobState()

    def submit(self, kind: str, task: Task, more: Callable[[Event], Then]) -> bool:
        """Says why where a job is under way already.

        `more` hears each event; what it returns of the last one follows once that is over.
        """
        try:
            with self.beginning, self._session.lock:
                if self.busy:
                    raise InputError("Something is being computed already; stop it or wait.")
                self.state = JobState(kind=kind, phase=QUEUED)
                self._number += 1
                number = self._number

                def relay(event: Event) -> None:
                    if number == self._number:
                        self._take_over(number, event, more)

                self.job = self._session.services.pool.submit(self._session.key, task, relay)
        except InputError as error:
            return self._session.refuse(error)
        self._session.notify(Topic.RUN)
        return True

    def _take_over(self, number: int, event: Event, more: Callable[[Event], Then]) -> None:
        then: Then = None
        with self._session.faults.watch(Part.RESULT):
            self._heard(event)
            then = more(event)
        if not isinstance(event, Ended):
            return
        with self.beginning:  # or who comes at the same moment is the next
            self._settled = max(self._settled, number)
            if then is not None:
                then()
        self._session.notify(Topic.RUN)

    def _heard(self, event: Event) -> None:
        with self._session.lock:
            run = self.state = self.state.after(event)
        self._session.notify(Topic.RUN)
        if run.phase in (FAILED, LOST):
            self._session.show_message(run.sentence, bad=True)
