"""Tasks that a worker can import, small and each with one habit; a listener that remembers."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from multiprocessing.connection import Connection
from typing import Any, TypeVar

import numpy as np

from flexgui.core.errors import InputError
from flexgui.core.progress import Progress
from flexgui.core.results import Generation
from flexgui.jobs import Event, Job, JobPool, Task, file_jobs, worker
from flexgui.jobs.messages import PoolSettings

E = TypeVar("E", bound=Event)

PATIENCE = 60.0
"""s, for what takes a fraction of one where nothing else runs."""

STEP = 0.005
"""s, of one step."""

EVEN = PoolSettings(niceness=0)
"""As everybody has it, but no step back behind other programs: where those keep every core busy, a
worker of a pool as it is by default gets a twentieth of one."""

MANY = 4000
"""Steps that last until the test stops them (20 s)."""


def count(steps: int, *, progress: Progress) -> int:
    """Steps done before it was stopped."""
    progress.stage("Counting", steps)
    for k in range(steps):
        if progress.stopped():
            return k
        time.sleep(STEP)
        progress.generation("count", Generation(k + 1, 1.0 / (k + 1), 1.0, 1.0, np.array([k])))
        progress.advance(text=f"{k + 1}")
    return steps


def sleep_deaf(seconds: float, *, progress: Progress) -> None:
    """Asks nobody whether it should stop."""
    progress.stage("Sleeping")
    time.sleep(seconds)


def spin(seconds: float, *, progress: Progress) -> None:
    """Keeps a processor busy and asks nobody."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        pass


def process_id(*, progress: Progress) -> int:
    return os.getpid()


def sevens(size: int, *, progress: Progress) -> np.ndarray:
    return np.full(size, 7.0)


def size_of(values: np.ndarray, *, progress: Progress) -> int:
    return values.size


def half_a_message(pipe: Connection, settings: PoolSettings) -> None:
    """What a worker has written that was stopped in between: a length, and nothing of it."""
    os.write(pipe.fileno(), (1000).to_bytes(4, "big"))
    time.sleep(PATIENCE)


def refuse(*, progress: Progress) -> None:
    raise InputError("rig.csv has no column theta2; add it.")


def crash(*, progress: Progress) -> None:
    raise ZeroDivisionError("a rig\nwithout length")


def unsendable(*, progress: Progress) -> object:
    return lambda: None


def die_quietly(*, progress: Progress) -> None:
    os._exit(3)


def loaded() -> None:
    """Once this is called, its module has been imported."""


def beat_often() -> None:
    """In a worker, before its first sign of life: four times as many."""
    worker.HEARTBEAT_INTERVAL = 0.5


def never_warm() -> None:
    raise RuntimeError("no warmth")


def never_there() -> None:
    os._exit(4)


def warm_readers() -> None:
    """The worker that reads files is ready before anybody waits for it, and as nice as everybody:
    loading what it reads with takes it half a minute on a machine that is busy with other work."""
    file_jobs.SETTINGS = replace(file_jobs.SETTINGS, niceness=0, kept=1)
    file_jobs._pool().start()
    assert eventually(lambda: file_jobs._pool().workers_ready > 0, file_jobs.SETTINGS.start_limit)


class Listener:
    """Keeps what it hears."""

    def __init__(self) -> None:
        self.events: list[Event] = []
        self.times: list[float] = []
        self._news = threading.Condition()

    def __call__(self, event: Event) -> None:
        with self._news:
            self.events.append(event)
            self.times.append(time.monotonic())
            self._news.notify_all()

    def of(self, kind: type[E]) -> list[E]:
        with self._news:
            return [e for e in self.events if isinstance(e, kind)]

    def wait_for(self, kind: type[E], timeout: float = PATIENCE) -> E:
        """The first event of that kind, now or later."""
        with self._news:
            assert self._news.wait_for(
                lambda: any(isinstance(e, kind) for e in self.events), timeout
            ), f"no {kind.__name__} within {timeout} s; heard {self.events}"
        return self.of(kind)[0]


def task(function: Callable[..., Any], **arguments: Any) -> Task:
    return Task.of(function, "The test", **arguments)


def begun(
    pool: JobPool, function: Callable[..., Any], session: str = "s", **arguments: Any
) -> tuple[Job, Listener]:
    """A job of a session, and what is heard of it."""
    heard = Listener()
    return pool.submit(session, task(function, **arguments), heard), heard


def eventually(condition: Callable[[], bool], timeout: float = PATIENCE) -> bool:
    """Whether the condition becomes true in time."""
    until = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > until:
            return False
        time.sleep(0.01)
    return True
