"""Where files that people bring are read, and long recordings simulated: never in the server.

A worker of its own, with limits of memory and time, so that neither a damaged nor a hostile file
takes the page down, and nobody's upload waits behind an identification.
"""

from __future__ import annotations

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

MEMORY = 700_000_000
"""Bytes: the largest table that is read (160 MB of numbers), its columns in SI units, and room to
put the pieces of both together."""
SECONDS = 60.0
"""For one file: the largest that is read, or the longest that is simulated, takes twenty alone."""
WORKERS = 2
"""So that one file which takes all its time leaves the other worker to everybody else."""
SETTINGS = PoolSettings(
    queued_per_session=16,
    calm=float("inf"),  # the second one only where somebody waits for it
    niceness=5,
    memory=MEMORY,
    seconds=SECONDS,
    warm_up="flexgui.jobs.inputs:warm_inputs",
)


def warm_inputs() -> None:
    """Reads nothing yet: the libraries that reading needs, so that the first file is not slow."""
    import pyarrow.csv
    import pyarrow.parquet  # noqa: F401

    import flexgui.scene.recorded_motion  # noqa: F401


@cache
def _pool() -> JobPool:
    """Made by the first wish; it ends with the process."""
    return JobPool(WORKERS, SETTINGS)


def ask(session: str, task: Task) -> Any:
    """The task's result, when it is there; InputError where it is refused, too large or too long.

    Waits for it: never on a thread that a browser's inputs need, which have `Errands`.
    """
    job = _pool().submit(session, task, lambda event: None)
    job.wait()
    return _result(task, job.ending)


def _result(task: Task, ending: Ended | None) -> Any:
    if isinstance(ending, Finished):
        return ending.result
    if isinstance(ending, WorkerLost):  # killed by the system, most likely for its memory
        raise InputError(f"{task.title} {TOO_LARGE}")
    if isinstance(ending, Failed):
        raise InputError(ending.sentence)
    raise InputError(f"{task.title} was stopped.")


def leave(session: str) -> None:
    """Nobody waits for what a session has asked."""
    if _pool.cache_info().currsize:
        _pool().leave(session)


Steps = Generator[Task, Any, Any]
"""Yields tasks and is sent their results; what is refused is raised at the yield."""


class Errands:
    """What a session does with files, one after the other, in the order in which it was begun.

    No thread waits for a worker meanwhile: what follows a task is done by the job's callback.
    """

    def __init__(
        self, session: str, on_text: Callable[[str], None], on_error: Callable[[Exception], None]
    ) -> None:
        """`on_text` gets how far a task is, `on_error` what ended an errand."""
        self._session, self._on_text, self._on_error = session, on_text, on_error
        self._lock = threading.Lock()
        self._queue: deque[tuple[Steps, Future[bool]]] = deque()
        """The first one is under way."""

    def begin(self, steps: Steps) -> Future[bool]:
        """Returns at once; what the steps return will be its result, False after an error."""
        done: Future[bool] = Future()
        with self._lock:
            self._queue.append((steps, done))
            first = len(self._queue) == 1
        if first:
            self._go_on(steps, done, partial(next, steps))
        return done

    def close(self) -> None:
        """Nothing more is done."""
        with self._lock:
            left = list(self._queue)
            self._queue.clear()
        for steps, _ in left:
            with suppress(ValueError):  # one that is at work ends by itself
                steps.close()

    def _go_on(self, steps: Steps, done: Future[bool], step: Callable[[], Task]) -> None:
        """Until there is a task to wait for, or nothing more to do."""
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
                _pool().submit(self._session, task, partial(self._hear, steps, done, task))
            except InputError as error:
                step = partial(steps.throw, error)
            else:
                return

    def _hear(self, steps: Steps, done: Future[bool], task: Task, event: Event) -> None:
        if isinstance(event, Advanced) and event.text:
            self._on_text(event.text)
        if not isinstance(event, Ended):
            return
        try:
            step = partial(steps.send, _result(task, event))
        except InputError as error:
            step = partial(steps.throw, error)
        self._go_on(steps, done, step)
