"""One submitted task, as the page holds it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from enum import Enum
from typing import TYPE_CHECKING, Any

from flexgui.jobs.dispatcher import Address
from flexgui.jobs.events import (
    Advanced,
    Ended,
    Event,
    Failed,
    Finished,
    NewGeneration,
    Paused,
    Queued,
    Resumed,
    Stage,
    Started,
    Stopped,
    WorkerLost,
)
from flexgui.jobs.task import Task

if TYPE_CHECKING:
    from flexgui.core.results import Generation
    from flexgui.jobs.pool import JobPool


class Pace:
    """Steps per second of the current stage, without the time in which it was paused."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self.stage(None)

    def stage(self, total: int | None) -> None:
        """A stage begins."""
        self._total, self._done, self._worked = total, 0, 0.0
        self._since: float | None = self._now()

    def advance(self, n: int) -> None:
        """Note that `n` steps are done."""
        self._done += n

    def pause(self) -> None:
        """Stop the clock."""
        self._worked, self._since = self._elapsed(), None

    def resume(self) -> None:
        """Let the clock go on."""
        if self._since is None:
            self._since = self._now()

    @property
    def remaining_seconds(self) -> float | None:
        """Of this stage; None where it is not known."""
        if not self._total or not self._done:
            return None
        left = max(self._total - self._done, 0)
        return self._elapsed() / self._done * left

    def _elapsed(self) -> float:
        return self._worked + (0.0 if self._since is None else self._now() - self._since)


class State(Enum):
    """Where a job stands."""

    QUEUED = "queued"
    RUNNING = "running"
    PAUSED = "paused"
    FINISHED = "finished"
    FAILED = "failed"
    STOPPED = "stopped"
    LOST = "lost"


_END_STATES: dict[type[Event], State] = {
    Finished: State.FINISHED,
    Failed: State.FAILED,
    Stopped: State.STOPPED,
    WorkerLost: State.LOST,
}


class Job:
    """Made by `JobPool.submit`; every method may be called from any thread and returns at once."""

    def __init__(self, pool: JobPool, session: str, task: Task, address: Address) -> None:
        self.session, self.task = session, task
        self.state = State.QUEUED
        self.place: int | None = None
        """1 is next; None once the job has left the queue."""
        self.stage = ""
        """Title of what it is doing."""
        self.latest: dict[str, Generation] = {}
        """The newest generation of each fit: what is left where a stop found no result."""
        self.ending: Ended | None = None
        """The last event."""
        self.stop_wished: float | None = None
        """When (monotonic) the user asked to stop it."""
        self.paused_since: float | None = None
        self._pool, self._address = pool, address
        self._lock = pool.lock
        self._pace = Pace()
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
            running = self.state in (State.RUNNING, State.PAUSED)
            return self._pace.remaining_seconds if running else None

    def stop(self) -> None:
        """Ends it with the best it has; one that waits goes from the queue."""
        with self._lock:
            if self.state is State.QUEUED:
                self._pool.withdraw(self)
                self.end(Stopped())
            elif not self.over and self.stop_wished is None:
                self.stop_wished = time.monotonic()

    def pause(self) -> None:
        """Holds a running job, and its worker with it; nothing happens to any other."""
        with self._lock:
            if self.state is State.RUNNING:
                self.state, self.paused_since = State.PAUSED, time.monotonic()
                self._pace.pause()
                self._address.post(Paused())

    def resume(self) -> None:
        """Lets a paused job go on."""
        with self._lock:
            if self.state is State.PAUSED:
                self.state, self.paused_since = State.RUNNING, None
                self._pace.resume()
                self._address.post(Resumed())

    def wait(self, timeout: float | None = None) -> bool:
        """Blocks until it is over (its callback may hear of it a moment later); for scripts."""
        return self._over.wait(timeout)

    # What follows is for the pool and its supervisors; they hold the lock.

    def queued(self, place: int) -> None:
        """Note its place in the queue, 1 is next."""
        if self.place != place:
            self.place = place
            self._address.post(Queued(place))

    def started(self) -> None:
        """Note that a worker has begun it."""
        self.state, self.place = State.RUNNING, None
        self._pace = Pace()
        self._address.post(Started())

    def observe(self, event: Event) -> None:
        """Takes note of what the worker said, and passes it on."""
        if isinstance(event, Stage):
            self.stage = event.title
            self._pace.stage(event.total)
        elif isinstance(event, Advanced):
            self._pace.advance(event.n)
        elif isinstance(event, NewGeneration):
            self.latest[event.label] = event.generation
        self._address.post(event)

    def end(self, event: Ended) -> None:
        """Note how it ended, and wake who waits."""
        self.state, self.ending, self.place = _END_STATES[type(event)], event, None
        self._address.post(event)
        self._over.set()

    def silence(self) -> None:
        """The callback hears nothing more."""
        self._address.close()
