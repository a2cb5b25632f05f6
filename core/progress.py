"""How a long computation reports its progress and is stopped."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Protocol

from .results import Generation, RecordingComparison

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


class StoppedError(Exception):
    """Raised by `check_stopped` in a computation that the user has stopped."""


_CURRENT: ContextVar[Progress | None] = ContextVar("_CURRENT", default=None)


@contextmanager
def use_progress(progress: Progress | None) -> Iterator[None]:
    """Inside it `check_stopped` asks this progress; None: the computation cannot be stopped. A new
    thread has none: start it with `set_progress(current_progress())`."""
    token = _CURRENT.set(progress)
    try:
        yield
    finally:
        _CURRENT.reset(token)


def set_progress(progress: Progress | None) -> None:
    """Sets the progress of the current thread until it ends."""
    _CURRENT.set(progress)


def current_progress() -> Progress | None:
    """The progress of the current thread; None where it has none."""
    return _CURRENT.get()


def check_stopped() -> None:
    """Raises StoppedError where the user asked to stop; called between parts of a computation."""
    progress = _CURRENT.get()
    if progress is not None and progress.stopped():
        raise StoppedError
