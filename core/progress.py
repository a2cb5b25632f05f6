"""How a long computation reports its progress and is stopped."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from functools import partial
from typing import Protocol, TypeVar

from .processors import is_limited
from .results import Generation, RecordingComparison

T = TypeVar("T")

Compared = Callable[[], RecordingComparison]
"""Compares a model with the first of the recordings that it is fitted to."""


class Progress(Protocol):
    """Receiver of the reports of a long computation: a terminal, a page, or nobody. What a derived
    class does not override reports nothing."""

    def stage(self, title: str, total: int | None = None) -> None:
        """A new stage begins, with `total` steps (None: unknown)."""
        return

    def advance(self, n: int = 1, text: str = "") -> None:
        """`n` steps of the stage are done; `text` describes the current one."""
        return

    def simulated(self, n: int) -> None:
        """`n` simulations more are done: what moves while a step takes long."""
        return

    def generation(self, fit_label: str, generation: Generation) -> None:
        """One generation of an evolution is done."""
        return

    def better(self, fit_label: str, cost: float, compared: Compared) -> None:
        """A fit has reached a lower cost (mean square); `compared` belongs to the model there."""
        return

    def stopped(self) -> bool:
        """Whether the user asked to stop; the computation then returns its best result."""


class Silent(Progress):
    """Reports nothing and never stops."""

    def stopped(self) -> bool:
        """Never."""
        return False


class Unseen(Progress):
    """Progress of a part of a larger computation: unseen, and stopped with it."""

    def __init__(self, whole: Progress) -> None:
        self._whole = whole

    def stopped(self) -> bool:
        """As it is asked of the whole."""
        return self._whole.stopped()


class StoppedError(Exception):
    """Raised by `check_stopped` in a computation that the user has stopped."""


_CURRENT: ContextVar[Progress | None] = ContextVar("_CURRENT", default=None)


@contextmanager
def use_progress(progress: Progress | None) -> Iterator[None]:
    """Inside it `check_stopped` asks this progress; None: the computation cannot be stopped. A new
    thread has none, unless it is of `core.processors.thread_pool`."""
    token = _CURRENT.set(progress)
    try:
        yield
    finally:
        _CURRENT.reset(token)


def current_progress() -> Progress | None:
    """The progress of the current thread; None where it has none."""
    return _CURRENT.get()


def check_stopped() -> None:
    """Raises StoppedError where the user asked to stop; called between parts of a computation."""
    progress = _CURRENT.get()
    if progress is not None and progress.stopped():
        raise StoppedError


class _Counter:
    """Counts simulations and passes the sum on, once in `every` s at most."""

    def __init__(self, progress: Progress, every: float) -> None:
        self.progress, self._every = progress, every
        self._lock, self._waiting, self._sent_at = threading.Lock(), 0, time.monotonic()

    def count(self, n: int) -> None:
        with self._lock:
            self._waiting += n
            if time.monotonic() - self._sent_at < self._every:
                return
            sent, self._waiting, self._sent_at = self._waiting, 0, time.monotonic()
        self.progress.simulated(sent)


_COUNTER: ContextVar[_Counter | None] = ContextVar("_COUNTER", default=None)


@contextmanager
def counted_simulations(progress: Progress, every: float = 0.5) -> Iterator[None]:
    """Inside it the progress gets how many simulations were done, once in `every` s at most, and
    what `announce` states."""
    token = _COUNTER.set(_Counter(progress, every))
    try:
        yield
    finally:
        _COUNTER.reset(token)


def count_simulations(n: int) -> None:
    """So many simulations were done."""
    counter = _COUNTER.get()
    if counter is not None:
        counter.count(n)


def announce(text: str) -> None:
    """States what is about to take long and cannot be counted."""
    counter = _COUNTER.get()
    if counter is not None:
        counter.progress.advance(0, text)


class _Beside(Silent):
    """Progress of work beside another: unseen until that waits for it, and stopped with it or once
    it has ended."""

    def __init__(self, other: Progress) -> None:
        self._other, self.ended = other, False
        self._shown, self._lock = False, threading.Lock()
        self._title, self._done = "", 0
        self._total: int | None = None

    def stage(self, title: str, total: int | None = None) -> None:
        with self._lock:
            self._title, self._total, self._done = title, total, 0
            if self._shown:
                self._other.stage(title, total)

    def advance(self, n: int = 1, text: str = "") -> None:
        with self._lock:
            self._done += n
            if self._shown:
                self._other.advance(n, text)

    def stopped(self) -> bool:
        return self.ended or self._other.stopped()

    def show(self) -> None:
        """From now on it is what is being done."""
        with self._lock:
            self._shown = True
            if self._title:
                self._other.stage(self._title, self._total)
                self._other.advance(self._done)


@contextmanager
def beside(work: Callable[[Progress], T], progress: Progress) -> Iterator[Callable[[], T]]:
    """The work is done on a thread of its own beside the block; what that gets waits for the
    result. With limited processors it is done when it is asked for."""
    if is_limited():
        yield partial(work, progress)
        return
    unseen = _Beside(progress)

    def result() -> T:
        unseen.show()
        return done.result()

    with ThreadPoolExecutor(1) as pool:
        done = pool.submit(work, unseen)
        try:
            yield result
        finally:
            unseen.ended = True
