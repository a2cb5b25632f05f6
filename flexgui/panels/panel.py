"""The contract of a stage's panel."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

from flexgui.panels.page_context import PageContext
from flexgui.session import Topic


class Panel(ABC):
    """Controls on the right, plots on the left; both are built once and then kept up to date."""

    kind: ClassVar[str] = ""
    """The stage that it belongs to."""
    topics: ClassVar[frozenset[Topic]] = frozenset()
    """What makes it draw itself anew."""

    def __init__(self, desk: PageContext) -> None:
        self.desk = desk

    @abstractmethod
    def build_controls(self) -> None:
        """Makes the inputs, inside the container that is open."""

    @abstractmethod
    def build_plots(self) -> None:
        """Makes the plots, inside the container that is open."""

    @abstractmethod
    def refresh(self) -> None:
        """Draws everything from the session; called while the stage is shown."""

    def move_cursor(self) -> None:  # noqa: B027 (most have nothing to move)
        """The time-line's cursor moved."""

    def settle(self) -> None:  # noqa: B027 (most have nothing that takes long)
        """Draws what takes long, once nothing has changed for a moment; after `refresh`."""
