"""The contract of a stage's panel, and what every panel of one browser works with."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar

import viser

from flexgui.page.layout import Theme
from flexgui.session import Session, Topic
from flexgui.session.state import Faults


class Panel(ABC):
    """Controls on the right, plots on the left; both are built once and then kept up to date."""

    kind: ClassVar[str] = ""
    """The stage that it belongs to."""
    topics: ClassVar[frozenset[Topic]] = frozenset()
    """What makes it draw itself anew."""

    def __init__(self, context: PageContext) -> None:
        self.context = context

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


@dataclass(frozen=True)
class PageContext:
    """One browser's page: its client and its session."""

    client: viser.ClientHandle
    session: Session
    read_only: bool = False
    """A follower sees everything and changes nothing: no callback is registered at all."""
    syncs: list[Callable[[], None]] = field(default_factory=list)
    """Called when the session changed: each brings one input up to date."""

    theme: Theme = field(init=False)
    faults: Faults = field(init=False)
    """Of this page's own parts."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "faults", Faults(lambda: self.session.notify(Topic.MESSAGE)))
        object.__setattr__(self, "theme", Theme(self.client))

    @property
    def gui(self) -> viser.GuiApi:
        """The widgets of this browser."""
        return self.client.gui
