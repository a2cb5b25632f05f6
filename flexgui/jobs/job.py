"""One submitted task, as the page holds it."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from flexgui.jobs.inbox import Inbox
from flexgui.jobs.messages import (
    Advanced,
    Ended,
    Event,
    Failed,
    Finished,
    NewGeneration,
    Order,
    Paused,
    Queued,
    Resumed,
    Stage,
    Started,
    Stopped,
    Stopping,
    Task,
    WorkerLost,
    merged,
)

if TYPE_CHECKING:
    from flexgui.core.results import Generation
    from flexgui.jobs.pool import JobPool


log = logging.getLogger(__name__)


IDLE, QUEUED, RUNNING, PAUSED = "idle", "queued", "running", "paused"
STOPPING = "stopping"
DONE, FAILED, STOPPED, LOST = "done", "failed", "stopped", "lost"
BUSY = (QUEUED, RUNNING, PAUSED, STOPPING)


@dataclass(frozen=True)
class JobState:
    """How a job stands, as its events have told it."""

    kind: str = ""
    """What it is for whoever has begun it."""
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

    def after(self, event: Event) -> JobState:
        """The record once the event has happened."""
        match event:
            case Stage(title, total):
                return replace(self, stage=title, total=total, done=0, text="")
            case Advanced(n, text):
                return replace(self, done=self.done + n, text=text or self.text)
            case NewGeneration(label, generation):
                # Only the newest population is drawn; thousands of them would stay in memory.
                before = self.history.get(label, ())
                last = tuple(replace(each, population=None) for each in before[-1:])
                return replace(
                    self, history={**self.history, label: (*before[:-1], *last, generation)}
                )
        phase = PHASES.get(type(event))
        if phase is None:
            return self
        place, sentence = getattr(event, "place", None), getattr(event, "sentence", "")
        return replace(self, phase=phase, place=place, sentence=sentence)


PHASES: dict[type[Event], str] = {
    Queued: QUEUED,
    Started: RUNNING,
    Paused: PAUSED,
    Resumed: RUNNING,
    Stopping: STOPPING,
    Finished: DONE,
    Stopped: STOPPED,
    Failed: FAILED,
    WorkerLost: LOST,
}
"""In which an event puts its job."""


class Job:
    """Made by `JobPool.submit`; every method may be called from any thread and returns at once."""

    def __init__(
        self, pool: JobPool, session: str, task: Task, callback: Callable[[Event], object]
    ) -> None:
        self.session, self.task = session, task
        self.state = JobState()
        self.ending: Ended | None = None
        """The last event."""
        self.stop_wished: float | None = None
        """When (monotonic) the user asked to stop it."""
        self.paused_since: float | None = None
        self.orders: deque[Order] = deque()
        """What the user wishes, and its worker has not been told."""
        self._pool, self._callback, self._silent = pool, callback, False
        self._inbox = Inbox(self._call_back, merged)
        self._lock = pool.lock
        self._clock_since, self._worked = time.monotonic(), 0.0
        """Since when the stage is timed, and the s of it before: pauses are left out."""
        self._over = threading.Event()

    @property
    def over(self) -> bool:
        """Whether it has ended, however it did."""
        return self.ending is not None

    @property
    def result(self) -> Any | None:
        """What it found, also where it was stopped; else None."""
        return getattr(self.ending, "result", None)

    @property
    def sentence(self) -> str:
        """Why it failed; else empty."""
        return getattr(self.ending, "sentence", "")

    @property
    def remaining_seconds(self) -> float | None:
        """Of the current stage, from its pace so far; None where nobody can know."""
        with self._lock:
            state = self.state
            if state.phase not in (RUNNING, PAUSED) or not state.total or not state.done:
                return None
            return self._seconds_worked() / state.done * max(state.total - state.done, 0)

    def _seconds_worked(self) -> float:
        """For the current stage."""
        until = time.monotonic() if self.paused_since is None else self.paused_since
        return self._worked + max(until - self._clock_since, 0.0)

    def stop(self) -> None:
        """Ends it with the best it has; one that waits goes from the queue."""
        with self._lock:
            if self.state.phase == QUEUED:
                self._pool.withdraw(self)
                self.observe(Stopped())
            elif not self.over and self.stop_wished is None:
                self.stop_wished = time.monotonic()
                self.orders.append(Order.STOP)
                self.observe(Stopping())

    def pause(self) -> None:
        """Holds a running job, and its worker with it; nothing happens to any other."""
        with self._lock:
            if self.state.phase == RUNNING:
                self.paused_since = time.monotonic()
                self.orders.append(Order.PAUSE)
                self.observe(Paused())

    def resume(self) -> None:
        """Lets a paused job go on."""
        with self._lock:
            if self.state.phase == PAUSED:
                self._worked, self._clock_since = self._seconds_worked(), time.monotonic()
                self.paused_since = None
                self.orders.append(Order.RESUME)
                self.observe(Resumed())

    def wait(self, timeout: float | None = None) -> bool:
        """Blocks until it is over (its callback may hear of it a moment later); for scripts."""
        return self._over.wait(timeout)

    def wait_heard(self, timeout: float) -> None:
        """Until the callback has heard all there was."""
        self._inbox.wait_idle(timeout)

    def observe(self, event: Event) -> None:
        """Takes note of what has happened, and passes it on; for who holds the pool's lock."""
        if isinstance(event, Started | Stage):
            self._clock_since, self._worked = time.monotonic(), 0.0
        self.state = self.state.after(event)
        if isinstance(event, Ended):  # before the callback hears of it, and asks
            self.ending = event
        self._inbox.put(event)
        if isinstance(event, Ended):
            self._over.set()

    def silence(self) -> None:
        """The callback hears nothing more."""
        self._silent = True

    def _call_back(self, events: list[Event]) -> None:
        for event in events:
            if self._silent:
                return
            try:
                self._callback(event)
            except Exception:
                log.exception("A callback failed on %s", type(event).__name__)
