"""Where files that people bring are read, and long recordings simulated: never in the server.

A worker of its own, with limits of memory and time, so that neither a damaged nor a hostile file
takes the page down, and nobody's upload waits behind an identification.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import cache
from typing import Any

from core.errors import InputError
from flexgui.jobs.events import Advanced, Event, Failed, Finished, WorkerLost
from flexgui.jobs.pool import JobPool
from flexgui.jobs.settings import TOO_LARGE, PoolSettings
from flexgui.jobs.task import Task

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
    warm_up="flexgui.jobs.worker:warm_inputs",
)

TextCallback = Callable[[str], None]


@cache
def _pool() -> JobPool:
    """Made by the first wish; it ends with the process."""
    return JobPool(WORKERS, SETTINGS)


def ask(session: str, task: Task, on_text: TextCallback | None = None) -> Any:
    """The task's result, when it is there; InputError where it is refused, too large or too long.

    `on_text` gets how far it is, from another thread, and nothing more once the result is there.
    """
    heard = _Heard(on_text)
    job = _pool().submit(session, task, heard)
    job.wait()
    heard.close()
    ending = job.ending
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


class _Heard:
    """Passes on what a job says until it is over."""

    def __init__(self, on_text: TextCallback | None) -> None:
        self._report = on_text
        self._lock = threading.Lock()

    def __call__(self, event: Event) -> None:
        with self._lock:
            if self._report is not None and isinstance(event, Advanced) and event.text:
                self._report(event.text)

    def close(self) -> None:
        with self._lock:
            self._report = None
