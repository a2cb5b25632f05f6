"""The job pool: submit a task, and a callback gets its events.

Sessions take turns: a session that submits more jobs does not get more time.
"""

from __future__ import annotations

import atexit
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator

from flexgui.core.errors import InputError
from flexgui.jobs.job import Job
from flexgui.jobs.messages import (
    DEFAULT,
    Ended,
    Event,
    Failed,
    PoolSettings,
    Queued,
    Started,
    Stopped,
    Task,
)
from flexgui.jobs.supervisor import WorkerSupervisor

CLOSING_SECONDS = 4.0
"""s for all workers to end after Ctrl-C."""

LAST_CALLBACK_SECONDS = 0.5
"""s for the callbacks to get the last events."""

Callback = Callable[[Event], None]


class JobPool:
    """Warm worker processes behind a fair queue. Every method may be called from any thread."""

    def __init__(self, workers: int = 2, settings: PoolSettings = DEFAULT) -> None:
        self.settings = settings
        self.lock = threading.RLock()
        """Held briefly, never while a callback runs or a message goes to a worker."""
        self.warming = threading.Lock()
        self.closing = threading.Event()
        self._changed = threading.Condition(self.lock)
        self._queue: FairQueue = FairQueue()
        self._active: set[Job] = set()
        self._started = False
        self._supervisors = [WorkerSupervisor(self, k + 1) for k in range(workers)]

    def __enter__(self) -> JobPool:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def workers_ready(self) -> int:
        """How many workers are warm, busy or not."""
        return len(self.worker_pids)

    @property
    def worker_pids(self) -> tuple[int, ...]:
        """Process ids of the warm workers."""
        return tuple(
            supervisor.pid for supervisor in self._supervisors if supervisor.pid is not None
        )

    @property
    def waiting(self) -> int:
        """Jobs in the queue."""
        with self.lock:
            return len(self._queue)

    def start(self) -> None:
        """Warms the workers in the background, as `submit` does too; InputError after the end."""
        with self.lock:
            if self.closing.is_set():
                raise InputError("FlexGUI is being closed; start it again to run this.")
            if not self._started:
                self._started = True
                atexit.register(self.close)
                for supervisor in self._supervisors:
                    supervisor.thread.start()

    def submit(self, session: str, task: Task, callback: Callback) -> Job:
        """InputError where the session has too much waiting already, or all is closing.

        `callback` is called from the pool's own threads, in order and one event at a time, the
        last one being Finished, Failed, Stopped or WorkerLost. It may call anything of a job.
        """
        with self.lock:
            self.start()
            limit = self.settings.queued_per_session
            if self._queue.waiting_of(session) >= limit:
                raise InputError(
                    f"{limit} jobs of this session wait already; stop one of them or let one start."
                )
            job = Job(self, session, task, callback)
            self._queue.put(job)
            self._report_places()
            self._changed.notify()
            return job

    def cancel_session(self, session: str) -> None:
        """Stops and drops all jobs of a session; its callbacks hear nothing more."""
        with self.lock:
            jobs = [job for job in (*self._queue.order(), *self._active) if job.session == session]
            for job in jobs:
                job.mute()
                job.stop()

    def close(self) -> None:
        """Stops everything and ends every worker, within five seconds."""
        with self.lock:
            if self.closing.is_set():
                return
            self.closing.set()
            jobs = [*self._queue.order(), *self._active]
            for job in list(self._queue.order()):
                self._queue.remove(job)
                job.record(Stopped())
            self._changed.notify_all()
        atexit.unregister(self.close)
        limit = time.monotonic() + CLOSING_SECONDS
        for supervisor in self._supervisors:
            if supervisor.thread.ident is not None:
                supervisor.thread.join(max(limit - time.monotonic(), 0.0))
        limit = time.monotonic() + LAST_CALLBACK_SECONDS
        for job in jobs:
            job.wait_for_callback(max(limit - time.monotonic(), 0.0))

    def _report_places(self) -> None:
        free = len(self._supervisors) - len(self._active)
        for before, job in enumerate(self._queue.order()):
            place = max(before + 1 - free, 0)
            if job.state.place != place:
                job.record(Queued(place))

    # For jobs and supervisors only:

    @property
    def wants_worker(self) -> bool:
        """Whether another worker should start: fewer are ready than are kept, or a job waits
        without a free one."""
        with self.lock:
            idle = self.workers_ready - len(self._active)
            return self.workers_ready < self.settings.kept or len(self._queue) > max(idle, 0)

    @property
    def has_spare_worker(self) -> bool:
        """Whether more are ready than are kept or needed."""
        with self.lock:
            return not len(self._queue) and self.workers_ready > self.settings.kept

    def next_job(self, timeout: float) -> Job | None:
        """The next job, started; None where there is none within `timeout` s."""
        with self.lock:
            if not len(self._queue) and not self.closing.is_set():
                self._changed.wait(timeout)
            job = None if self.closing.is_set() else self._queue.take()
            if job is not None:
                self._active.add(job)
                job.record(Started())
                self._report_places()
            return job

    def withdraw(self, job: Job) -> None:
        """Removes a waiting job from the queue."""
        with self.lock:
            self._queue.remove(job)
            self._report_places()

    def job_over(self, job: Job, ending: Ended) -> None:
        """Ends a job; called by its supervisor."""
        with self.lock:
            self._active.discard(job)
            self._queue.done(job)
            job.record(ending)
            self._report_places()

    def fail_waiting(self, sentence: str) -> None:
        """Fails all waiting jobs: no worker can be started."""
        with self.lock:
            if self.workers_ready:
                return
            for job in list(self._queue.order()):
                self._queue.remove(job)
                job.record(Failed(sentence))


class FairQueue:
    """Within a session first come, first served. Between sessions the one with the fewest running
    jobs goes first; among equals the one that was served longest ago. Not thread-safe."""

    def __init__(self) -> None:
        self._waiting: dict[str, deque[Job]] = {}
        """Waiting jobs by session; the order of the sessions is their turn."""
        self._busy: Counter[str] = Counter()

    def __len__(self) -> int:
        return sum(len(items) for items in self._waiting.values())

    def waiting_of(self, session: str) -> int:
        """How many items of a session wait."""
        return len(self._waiting.get(session, ()))

    def put(self, item: Job) -> None:
        """Add an item behind those of its session."""
        self._waiting.setdefault(item.session, deque()).append(item)

    def remove(self, item: Job) -> None:
        """Forget an item that waits."""
        items = self._waiting[item.session]
        items.remove(item)
        if not items:
            del self._waiting[item.session]

    def take(self) -> Job | None:
        """The next item, which then counts as running; None where nothing waits."""
        return _take_next(self._waiting, self._busy) if self._waiting else None

    def done(self, item: Job) -> None:
        """An item that was taken is no longer running."""
        self._busy[item.session] -= 1
        self._busy = +self._busy  # only sessions that are busy

    def order(self) -> Iterator[Job]:
        """All waiting items in the order in which they would be taken if no job ended meanwhile."""
        waiting = {session: items.copy() for session, items in self._waiting.items()}
        busy = self._busy.copy()
        while waiting:
            yield _take_next(waiting, busy)


def _take_next(waiting: dict[str, deque[Job]], busy: Counter[str]) -> Job:
    """Takes the next item; its session goes to the end."""
    session = min(waiting, key=busy.__getitem__)  # the first of equals
    items = waiting.pop(session)
    item = items.popleft()
    if items:
        waiting[session] = items
    busy[session] += 1
    return item
