"""Reads uploaded files and simulates long recordings in workers of their own, not in the server.

These workers have limits of memory and time: a damaged or hostile file cannot stop the page, and no
upload waits behind an identification.
"""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable, Generator
from concurrent.futures import Future
from contextlib import suppress
from functools import cache, partial
from typing import Any

from flexgui.core.errors import InputError
from flexgui.jobs.messages import (
    Advanced,
    Ended,
    Event,
    Failed,
    Finished,
    PoolSettings,
    Task,
    WorkerLost,
)
from flexgui.jobs.pool import JobPool
from flexgui.jobs.worker import TOO_LARGE

MEMORY = 1_500_000_000
"""Bytes: the largest table that is read (160 MB of numbers), its columns in SI units, and room to
put the pieces of both together and to check them."""
FILE_SECONDS = 60.0
"""For one file: the largest file, or the longest simulation, takes 20 s on a free machine."""
WORKERS = 2
"""Two, so that one slow file does not block all others."""
SETTINGS = PoolSettings(
    queued_per_session=16,
    kept=0,  # minutes pass between two files
    niceness=5,
    memory=MEMORY,
    seconds=FILE_SECONDS,
    warm_up="flexgui.jobs.file_jobs:warm_file_worker",
)


def warm_file_worker() -> None:
    """Imports the libraries that reading needs, so that the first file is not slow."""
    # Arrow's own allocator reserves a gigabyte at its first table, which counts as used.
    os.environ["ARROW_DEFAULT_MEMORY_POOL"] = "system"
    import pyarrow.csv
    import pyarrow.parquet  # noqa: F401

    import flexgui.scene.recorded_motion  # noqa: F401


@cache
def _pool() -> JobPool:
    """Made by the first call; ends with the process."""
    return JobPool(WORKERS, SETTINGS)


def run_task(session: str, task: Task) -> Any:
    """Waits for the task and returns its result; InputError if it fails, is too large or too slow.

    Do not call it on a thread that handles a browser's inputs: use `FileJobs` there.
    """
    job = _pool().submit(session, task, lambda event: None)
    job.wait()
    return _result(task, job.ending)


def _result(task: Task, ending: Ended | None) -> Any:
    if isinstance(ending, Finished):
        return ending.result
    if isinstance(ending, WorkerLost):  # the system killed it, most likely for its memory
        raise InputError(f"{task.title} {TOO_LARGE}")
    if isinstance(ending, Failed):
        raise InputError(ending.sentence)
    raise InputError(f"{task.title} was stopped.")


def cancel_session(session: str) -> None:
    """Stops all file tasks of a session that has ended."""
    if _pool.cache_info().currsize:
        _pool().cancel_session(session)


TaskSteps = Generator[Task, Any, Any]
"""A generator that yields tasks and receives their results; errors are raised at the yield."""


class FileJobs:
    """The file work of one session, one sequence of tasks after another, in the order of `start`.

    No thread waits for a worker: the job's callback continues the sequence.
    """

    def __init__(
        self, session: str, on_text: Callable[[str], None], on_error: Callable[[Exception], None]
    ) -> None:
        """`on_text` gets a task's progress, `on_error` the error that ended a sequence."""
        self._session, self._on_text, self._on_error = session, on_text, on_error
        self._lock = threading.Lock()
        self._queue: deque[tuple[TaskSteps, Future[bool]]] = deque()
        """The first one is running."""

    @property
    def idle(self) -> bool:
        """Whether no sequence runs or waits."""
        with self._lock:
            return not self._queue

    def start(self, steps: TaskSteps) -> Future[bool]:
        """Returns at once; the future gets what the steps return, False after an error."""
        done: Future[bool] = Future()
        with self._lock:
            self._queue.append((steps, done))
            first = len(self._queue) == 1
        if first:
            self._continue(steps, done, partial(next, steps))
        return done

    def close(self) -> None:
        """Starts nothing more."""
        with self._lock:
            waiting = list(self._queue)
            self._queue.clear()
        for steps, _ in waiting:
            with suppress(ValueError):  # a running one ends by itself
                steps.close()

    def _continue(self, steps: TaskSteps, done: Future[bool], step: Callable[[], Task]) -> None:
        """Runs steps until one is a task to wait for, or the queue is empty."""
        while True:
            try:
                task = step()
            except Exception as end:
                if not isinstance(end, StopIteration):
                    self._on_error(end)
                done.set_result(isinstance(end, StopIteration) and bool(end.value))
                with self._lock:
                    self._queue = deque(each for each in self._queue if each[0] is not steps)
                    if not self._queue:
                        return
                    steps, done = self._queue[0]
                step = partial(next, steps)
                continue
            try:
                _pool().submit(self._session, task, partial(self._on_event, steps, done, task))
            except InputError as error:
                step = partial(steps.throw, error)
            else:
                return

    def _on_event(self, steps: TaskSteps, done: Future[bool], task: Task, event: Event) -> None:
        if isinstance(event, Advanced) and event.text:
            self._on_text(event.text)
        if not isinstance(event, Ended):
            return
        try:
            step = partial(steps.send, _result(task, event))
        except InputError as error:
            step = partial(steps.throw, error)
        self._continue(steps, done, step)
