"""One submitted task, as the page holds it."""

from __future__ import annotations

import logging
import threading
import time
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
        step = _AFTER.get(type(event))
        return self if step is None else step(self, event)


def _generation(state: JobState, event: Any) -> JobState:
    """Of the populations only the newest is drawn; thousands of them would stay in memory."""
    generations = state.history.get(event.label, ())
    before = (*generations[:-1], *(replace(last, population=None) for last in generations[-1:]))
    return replace(state, history={**state.history, event.label: (*before, event.generation)})


def _phase(phase: str) -> Callable[[JobState, Any], JobState]:
    return lambda state, event: replace(state, phase=phase, place=None)


def _bad(phase: str) -> Callable[[JobState, Any], JobState]:
    return lambda state, event: replace(state, phase=phase, place=None, sentence=event.sentence)


_AFTER: dict[type[Event], Callable[[JobState, Any], JobState]] = {
    Queued: lambda state, event: replace(state, phase=QUEUED, place=event.place),
    Started: _phase(RUNNING),
    Paused: _phase(PAUSED),
    Resumed: _phase(RUNNING),
    Stopping: _phase(STOPPING),
    Stage: lambda state, event: replace(
        state, stage=event.title, total=event.total, done=0, text=""
    ),
    Advanced: lambda state, event: replace(
        state, done=state.done + event.n, text=event.text or state.text
    ),
    NewGeneration: _generation,
    Finished: _phase(DONE),
    Stopped: _phase(STOPPED),
    Failed: _bad(FAILED),
    WorkerLost: _bad(LOST),
}


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
        self._pool, self._callback, self._silent = pool, callback, False
        self._inbox = Inbox(self._call_back, merged)
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
            running = self.state.phase in (RUNNING, PAUSED)
            return self._pace.remaining_seconds if running else None

    def stop(self) -> None:
        """Ends it with the best it has; one that waits goes from the queue."""
        with self._lock:
            if self.state.phase == QUEUED:
                self._pool.withdraw(self)
                self.observe(Stopped())
            elif not self.over and self.stop_wished is None:
                self.stop_wished = time.monotonic()
                self.observe(Stopping())

    def pause(self) -> None:
        """Holds a running job, and its worker with it; nothing happens to any other."""
        with self._lock:
            if self.state.phase == RUNNING:
                self.paused_since = time.monotonic()
                self._pace.pause()
                self.observe(Paused())

    def resume(self) -> None:
        """Lets a paused job go on."""
        with self._lock:
            if self.state.phase == PAUSED:
                self.paused_since = None
                self._pace.resume()
                self.observe(Resumed())

    def wait(self, timeout: float | None = None) -> bool:
        """Blocks until it is over (its callback may hear of it a moment later); for scripts."""
        return self._over.wait(timeout)

    def wait_heard(self, timeout: float) -> None:
        """Until the callback has heard all there was."""
        self._inbox.wait_idle(timeout)

    # What follows is for the pool and its supervisors; they hold the lock.

    def queued(self, place: int) -> None:
        """Note its place in the queue, 1 is next."""
        if self.state.place != place:
            self.observe(Queued(place))

    def observe(self, event: Event) -> None:
        """Takes note of what has happened, and passes it on."""
        if isinstance(event, Started):
            self._pace = Pace()
        elif isinstance(event, Stage):
            self._pace.stage(event.total)
        elif isinstance(event, Advanced):
            self._pace.advance(event.n)
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
