"""Independent cases as jobs of a pool: the page's, or one of a command's own."""

from __future__ import annotations

import threading
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from flexgui.core.errors import InputError
from flexgui.core.processors import WORKERS
from flexgui.core.resumable.executor import (
    POLL_INTERVAL,
    Answers,
    Executor,
    Stop,
    Work,
    WorkFailedError,
    never,
)
from flexgui.jobs.job import QUEUED, Job
from flexgui.jobs.messages import Failed, PoolSettings, Stopped, Task, WorkerLost
from flexgui.jobs.pool import JobPool
from flexgui.jobs.worker import exit_process

if TYPE_CHECKING:
    from flexgui.core.progress import Progress

MOST_LOSSES = 3
"""An order that so many workers died over is not given to another."""


def run_case(work: str, order: str, *, progress: Progress) -> str:
    """The record of the case that `order` states, both as text; `work` names who makes it."""
    try:
        record = Task(work).resolve()(order)
    except MemoryError:  # as where the system ended it: another worker may find more memory
        exit_process()
    assert isinstance(record, str)
    return record


class QueueExecutor(Executor):
    """Between two cases other sessions have their turn: the pool's queue is fair.

    At most `at_once` cases are under way, and at most one of them waits in the queue. What is under
    way when somebody stops may still end within the pool's patience, and then counts.
    """

    def __init__(self, pool: JobPool, session: str, at_once: int = 2) -> None:
        self._pool, self._session, self._at_once = pool, session, at_once
        self._news = threading.Event()

    def answers(self, work: Work, orders: Sequence[str], stop: Stop = never) -> Answers:
        tasks = [
            Task.of(run_case, "A case of the study", work=Task.name(work), order=order)
            for order in orders
        ]
        waiting, losses = deque(range(len(tasks))), Counter[int]()
        running: dict[int, Job] = {}
        try:
            while waiting or running:
                if stop():
                    waiting.clear()
                    _stop(running)
                self._submit(waiting, running, tasks)
                self._news.wait(POLL_INTERVAL)
                self._news.clear()
                yield from _collect(waiting, running, losses)
        finally:
            _stop(running)

    def _submit(self, waiting: deque[int], running: dict[int, Job], tasks: Sequence[Task]) -> None:
        while waiting and len(running) < self._at_once and not _queued(running):
            index = waiting.popleft()
            running[index] = self._pool.submit(
                self._session, tasks[index], lambda _: self._news.set()
            )


ALONE = PoolSettings(silence=300.0, niceness=0, memory=None, warm_up=None)
"""Nobody waits at a page: workers may use the machine."""


class Processes(Executor):
    """As many at a time as there are workers, in a pool that lives as long as the work."""

    def __init__(self, workers: int = WORKERS, option: str = "--workers") -> None:
        """`option` is how whoever chose the number of workers knows it."""
        if workers < 1:
            raise InputError(f"{option} is {workers}; it must be at least 1.")
        self.count = workers
        self._pool: JobPool | None = None

    def pids(self) -> tuple[int, ...]:
        """Of the workers that there are now."""
        return () if self._pool is None else self._pool.worker_pids

    def answers(self, work: Work, orders: Sequence[str], stop: Stop = never) -> Answers:
        count = min(self.count, len(orders))
        with JobPool(count, ALONE) as self._pool:
            yield from QueueExecutor(self._pool, "cases", count).answers(work, orders, stop)


def _queued(running: dict[int, Job]) -> bool:
    return any(job.state.phase == QUEUED for job in running.values())


def _stop(running: dict[int, Job]) -> None:
    for job in running.values():
        job.stop()


def _collect(
    waiting: deque[int], running: dict[int, Job], losses: Counter[int]
) -> Iterator[tuple[int, str]]:
    """Answers that have come; the case of a worker that died goes to the front."""
    for index, job in tuple(running.items()):
        if not job.over:
            continue
        del running[index]
        if isinstance(job.ending, Failed):
            raise _error_of(job.ending)
        if isinstance(job.ending, WorkerLost):
            losses[index] += 1
            if losses[index] >= MOST_LOSSES:
                raise InputError(
                    f"{MOST_LOSSES} workers stopped on the same task; check the free memory and "
                    f"start again. Finished tasks are kept."
                )
            waiting.appendleft(index)
        if job.stop_requested_at is not None or isinstance(job.ending, Stopped):
            waiting.clear()  # whoever ended it wants no other one begun
        if job.result is not None:
            yield index, job.result


def _error_of(ending: Failed) -> Exception:
    if ending.traceback:
        return WorkFailedError(ending.sentence, ending.traceback)
    return InputError(ending.sentence)
