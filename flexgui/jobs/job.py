"""One submitted job: its state from its events, and the orders to its worker."""

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
    merge_events,
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
    """The progress of a job, from its events so far."""

    kind: str = ""
    """Which kind of job its caller started."""
    phase: str = IDLE
    place: int | None = None
    """In the queue, 1 is next; 0 while its worker is being started."""
    stage: str = ""
    text: str = ""
    done: int = 0
    total: int | None = None
    simulations: int = 0
    """In the stage."""
    sentence: str = ""
    """Why it failed."""
    history: Mapping[str, tuple[Generation, ...]] = field(default_factory=dict)
    """The generations reported so far, by fit; only the newest has its population."""

    @property
    def busy(self) -> bool:
        """Whether the job waits or runs."""
        return self.phase in BUSY

    @property
    def share(self) -> float | None:
        """Share of the current stage that is done, 0 to 1; None if its length is not known."""
        return min(self.done / self.total, 1.0) if self.total else None

    def after(self, event: Event) -> JobState:
        """The state after an event."""
        match event:
            case Stage(title, total):
                return replace(self, stage=title, total=total, done=0, text="", simulations=0)
            case Advanced(n, text, more):
                simulations = self.simulations + more
                done, text = self.done + n, text or self.text
                return replace(self, done=done, text=text, simulations=simulations)
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
"""Phase of the job after an event."""


class Job:
    """Made by `JobPool.submit`; every method may be called from any thread and returns at once."""

    def __init__(
        self, pool: JobPool, session: str, task: Task, callback: Callable[[Event], object]
    ) -> None:
        self.session, self.task = session, task
        self.state = JobState()
        self.ending: Ended | None = None
        """The last event."""
        self.stop_requested_at: float | None = None
        """When (monotonic) the user asked to stop it."""
        self.paused_since: float | None = None
        self.orders: deque[Order] = deque()
        """Orders of the user that were not sent to the worker yet."""
        self._pool, self._callback, self._muted = pool, callback, False
        self._inbox = Inbox(self._run_callback, merge_events)
        self._lock = pool.lock
        self._clock_since, self._worked = time.monotonic(), 0.0
        """Start of the current timing of the stage, and the s before it; pauses do not count."""
        self._over = threading.Event()

    @property
    def over(self) -> bool:
        """Whether it has ended in any way."""
        return self.ending is not None

    @property
    def result(self) -> Any | None:
        """The result, also of a stopped job; None without one."""
        return getattr(self.ending, "result", None)

    @property
    def remaining_seconds(self) -> float | None:
        """Seconds of the current stage, from its pace so far; None without an estimate."""
        with self._lock:
            state = self.state
            if state.phase not in (RUNNING, PAUSED) or not state.total or not state.done:
                return None
            return self._seconds_worked() / state.done * max(state.total - state.done, 0)

    def _seconds_worked(self) -> float:
        """s of work on the current stage, without pauses."""
        until = time.monotonic() if self.paused_since is None else self.paused_since
        return self._worked + max(until - self._clock_since, 0.0)

    def stop(self) -> None:
        """Ends it with the best result so far; removes a waiting job from the queue."""
        with self._lock:
            if self.state.phase == QUEUED:
                self._pool.withdraw(self)
                self.record(Stopped())
            elif not self.over and self.stop_requested_at is None:
                self.stop_requested_at = time.monotonic()
                self.orders.append(Order.STOP)
                self.record(Stopping())

    def pause(self) -> None:
        """Pauses a running job together with its worker."""
        with self._lock:
            if self.state.phase == RUNNING:
                self.paused_since = time.monotonic()
                self.orders.append(Order.PAUSE)
                self.record(Paused())

    def resume(self) -> None:
        """Continues a paused job."""
        with self._lock:
            if self.state.phase == PAUSED:
                self._worked, self._clock_since = self._seconds_worked(), time.monotonic()
                self.paused_since = None
                self.orders.append(Order.RESUME)
                self.record(Resumed())

    def wait(self, timeout: float | None = None) -> bool:
        """Blocks until it is over (its callback may be called a moment later), or for a `timeout`
        in s; for scripts."""
        return self._over.wait(timeout)

    def wait_for_callback(self, timeout: float) -> None:
        """Waits until the callback got all events, or for a `timeout` in s."""
        self._inbox.wait_idle(timeout)

    def record(self, event: Event) -> None:
        """Updates the state and passes the event to the callback; call it under the pool's lock."""
        if isinstance(event, Started | Stage):
            self._clock_since, self._worked = time.monotonic(), 0.0
        self.state = self.state.after(event)
        if isinstance(event, Ended):  # before the callback, which may ask for it
            self.ending = event
        self._inbox.put(event)
        if isinstance(event, Ended):
            self._over.set()

    def mute(self) -> None:
        """Calls the callback no more."""
        self._muted = True

    def _run_callback(self, events: list[Event]) -> None:
        for event in events:
            if self._muted:
                return
            try:
                self._callback(event)
            except Exception:
                log.exception("A callback failed on %s", type(event).__name__)
