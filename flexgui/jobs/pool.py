"""The pool: submit a task, and a callback hears how it goes.

Sessions take turns: whoever submits more does not get more.
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

CLOSING = 4.0
"""s for all workers to end, well within what a person waits after Ctrl-C."""

LAST_NEWS = 0.5
"""s for the callbacks to hear it."""

Callback = Callable[[Event], None]


class JobPool:
    """Warm worker processes behind a fair queue. Every method may be called from any thread."""

    def __init__(self, workers: int = 2, settings: PoolSettings = DEFAULT) -> None:
        self.settings = settings
        self.lock = threading.RLock()
        """Held for moments only, never while a callback is called or a worker is spoken to."""
        self.warming = threading.Lock()
        self.closing = threading.Event()
        self._news = threading.Condition(self.lock)
        self._queue: FairQueue = FairQueue()
        self._active: set[Job] = set()
        self._started = False
        self._stirred = 0.0
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
    def workers_free(self) -> int:
        """How many workers are warm and have no job."""
        return sum(supervisor.free for supervisor in self._supervisors)

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
            self._news.notify()
            return job

    def leave(self, session: str) -> None:
        """Stops and drops all jobs of a session; its callbacks hear nothing more."""
        with self.lock:
            mine = [job for job in (*self._queue.order(), *self._active) if job.session == session]
            for job in mine:
                job.silence()
                job.stop()

    def close(self) -> None:
        """Stops everything and ends every worker, within five seconds."""
        with self.lock:
            if self.closing.is_set():
                return
            self.closing.set()
            last = [*self._queue.order(), *self._active]
            for job in list(self._queue.order()):
                self._queue.remove(job)
                job.observe(Stopped())
            self._news.notify_all()
        atexit.unregister(self.close)
        until = time.monotonic() + CLOSING
        for supervisor in self._supervisors:
            if supervisor.thread.ident is not None:
                supervisor.thread.join(max(until - time.monotonic(), 0.0))
        until = time.monotonic() + LAST_NEWS
        for job in last:
            job.wait_heard(max(until - time.monotonic(), 0.0))

    def _report_places(self) -> None:
        for place, job in enumerate(self._queue.order(), start=1):
            if job.state.place != place:
                job.observe(Queued(place))

    # What follows is for jobs and supervisors.

    @property
    def wants_worker(self) -> bool:
        """Whether one more is worth the cores that its start takes from what runs: where a job
        waits in vain, there is none yet, or all has been calm for a while."""
        with self.lock:
            idle = self.workers_ready - len(self._active)
            calm = time.monotonic() - self._stirred > self.settings.calm
            return calm or not self.workers_ready or len(self._queue) > max(idle, 0)

    def stir(self) -> None:
        """A worker came, or a job began: whoever clicks now shall have the cores."""
        self._stirred = time.monotonic()

    def next_job(self, timeout: float) -> Job | None:
        """The next job, started; None where there is none within `timeout` s."""
        with self.lock:
            if not len(self._queue) and not self.closing.is_set():
                self._news.wait(timeout)
            job = None if self.closing.is_set() else self._queue.take()
            if job is not None:
                self._active.add(job)
                job.observe(Started())
                self.stir()
                self._report_places()
            return job

    def withdraw(self, job: Job) -> None:
        """A job that waits is no longer wanted."""
        with self.lock:
            self._queue.remove(job)
            self._report_places()

    def job_over(self, job: Job, ending: Ended) -> None:
        """A supervisor has done what it could for a job."""
        with self.lock:
            self._active.discard(job)
            self._queue.done(job)
            job.observe(ending)
            self._report_places()

    def give_up_waiting(self, sentence: str) -> None:
        """No worker will come: who waits is told."""
        with self.lock:
            if self.workers_ready:
                return
            for job in list(self._queue.order()):
                self._queue.remove(job)
                job.observe(Failed(sentence))


class FairQueue:
    """Within a session first come, first served. Between sessions the one with the least work
    under way goes first; equals go round, and whoever joins or was served stands at the end.
    Not thread-safe."""

    def __init__(self) -> None:
        self._round: dict[str, deque[Job]] = {}
        """What waits; a dict keeps the order of the round."""
        self._busy: Counter[str] = Counter()

    def __len__(self) -> int:
        return sum(len(items) for items in self._round.values())

    def waiting_of(self, session: str) -> int:
        """How many items of a session wait."""
        return len(self._round.get(session, ()))

    def put(self, item: Job) -> None:
        """Add an item behind those of its session."""
        self._round.setdefault(item.session, deque()).append(item)

    def remove(self, item: Job) -> None:
        """Forget an item that waits."""
        items = self._round[item.session]
        items.remove(item)
        if not items:
            del self._round[item.session]

    def take(self) -> Job | None:
        """The next item, which is then under way; None where nothing waits."""
        return _serve(self._round, self._busy) if self._round else None

    def done(self, item: Job) -> None:
        """An item that was taken is no longer under way."""
        self._busy[item.session] -= 1
        self._busy = +self._busy  # only sessions that are busy

    def order(self) -> Iterator[Job]:
        """All that wait, in the order in which they would go if nothing ended meanwhile."""
        again = {session: items.copy() for session, items in self._round.items()}
        busy = self._busy.copy()
        while again:
            yield _serve(again, busy)


def _serve(waiting: dict[str, deque[Job]], busy: Counter[str]) -> Job:
    """Takes the next item; its session goes to the end of the round."""
    session = min(waiting, key=busy.__getitem__)  # the first of equals
    items = waiting.pop(session)
    item = items.popleft()
    if items:
        waiting[session] = items
    busy[session] += 1
    return item
