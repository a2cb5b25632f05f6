"""How long work tells what it is doing, and how it learns that it should stop."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Protocol

from .results import Generation, RecordingComparison

Compared = Callable[[], RecordingComparison]
"""Computes how a model stands beside the first of the recordings that it is fitted to."""


class Progress(Protocol):
    """What a long computation calls; a terminal, a page or nobody may listen."""

    def stage(self, title: str, total: int | None = None) -> None:
        """A new stage begins, with `total` steps where that is known."""

    def advance(self, n: int = 1, text: str = "") -> None:
        """`n` steps of the stage are done; `text` says where it stands."""

    def generation(self, fit_label: str, generation: Generation) -> None:
        """One generation of an evolution is done."""

    def better(self, fit_label: str, cost: float, compared: Compared) -> None:
        """A fit has come to a lower cost, a mean square; `compared` is of the model there."""

    def stopped(self) -> bool:
        """Whether the user asked to stop; the work then ends with the best it has."""


class Silent:
    """Nobody listens, nobody stops."""

    def stage(self, title: str, total: int | None = None) -> None:
        """Say nothing."""

    def advance(self, n: int = 1, text: str = "") -> None:
        """Say nothing."""

    def generation(self, fit_label: str, generation: Generation) -> None:
        """Say nothing."""

    def better(self, fit_label: str, cost: float, compared: Compared) -> None:
        """Say nothing."""

    def stopped(self) -> bool:
        """Never."""
        return False


class StoppedError(Exception):
    """Raised by `look` in the middle of a long computation that nobody waits for any more."""


_HEEDED: ContextVar[Progress | None] = ContextVar("_HEEDED", default=None)


@contextmanager
def heeding(progress: Progress | None) -> Iterator[None]:
    """Within it `look` heeds this progress; None: nobody can stop what runs. Threads begin without
    one: who starts them lets them `heed(heeded())`."""
    token = _HEEDED.set(progress)
    try:
        yield
    finally:
        _HEEDED.reset(token)


def heed(progress: Progress | None) -> None:
    """`heeding` for the rest of a thread."""
    _HEEDED.set(progress)


def heeded() -> Progress | None:
    """Whose wish to stop counts here."""
    return _HEEDED.get()


def look() -> None:
    """Between two stretches of a long computation: StoppedError where the user asked to stop."""
    progress = _HEEDED.get()
    if progress is not None and progress.stopped():
        raise StoppedError
