"""How long work tells what it is doing, and how it learns that it should stop."""

from __future__ import annotations

from typing import Protocol

from core.results import Generation


class Progress(Protocol):
    """What a long computation calls; a terminal, a page or nobody may listen."""

    def stage(self, title: str, total: int | None = None) -> None:
        """A new stage begins, with `total` steps where that is known."""

    def advance(self, n: int = 1, text: str = "") -> None:
        """`n` steps of the stage are done; `text` says where it stands."""

    def generation(self, fit_label: str, generation: Generation) -> None:
        """One generation of an evolution is done."""

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

    def stopped(self) -> bool:
        """Never."""
        return False
