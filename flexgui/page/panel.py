"""The contract of a stage's panel, and what every piece of one browser's page works with."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar

import viser

from flexgui.page.actions import Actions
from flexgui.page.layout import Theme
from flexgui.page.plot import PlotArea
from flexgui.session.session import Session
from flexgui.session.state import Faults, Topic


@dataclass
class PageContext:
    """One browser's page: its client and its session."""

    client: viser.ClientHandle
    session: Session
    read_only: bool = False
    """A follower sees everything and changes nothing: no callback is registered at all."""
    syncs: list[Callable[[], None]] = field(default_factory=list)
    """Called when the session changed, each brings one input up to date: of the stage that is being
    built, and after that of what stands around all stages."""
    plot_area: PlotArea = field(default_factory=PlotArea)
    actions: Actions = field(default_factory=Actions)
    """What the HTML of this page can do."""

    def __post_init__(self) -> None:
        self.faults = Faults(lambda: self.session.notify(Topic.MESSAGE))
        """Of this page's own parts."""
        self.theme = Theme(self.client)

    @property
    def gui(self) -> viser.GuiApi:
        """The widgets of this browser."""
        return self.client.gui


class PageElement:
    """Some widgets that belong together."""

    def __init__(self, context: PageContext) -> None:
        self.context = context

    @property
    def session(self) -> Session:
        """What the page shows."""
        return self.context.session

    @property
    def gui(self) -> viser.GuiApi:
        """The widgets of this browser."""
        return self.context.gui

    def enable(self, able: bool, *inputs: Any) -> None:
        """Whether inputs can be used; by a follower none."""
        for each in inputs:
            each.disabled = not able or self.context.read_only

    def send(self, name: str, content: bytes, without: str = "") -> None:
        """A file for the browser; `without` says why it lacks the recordings."""
        self.context.client.send_file_download(name, content, save_immediately=True)
        lacks = f", without recordings: {without}" if without else ""
        sentence = f"{name} was sent to your browser{lacks}"
        self.session.show_message(sentence.rstrip(".") + ".", bad=bool(without))


class Panel(PageElement, ABC):
    """Controls on the right, plots on the left; both are built once and then kept up to date."""

    kind: ClassVar[str] = ""
    """The stage that it belongs to."""
    topics: ClassVar[frozenset[Topic]] = frozenset()
    """What makes it draw itself anew."""

    @property
    def done(self) -> bool:
        """Whether its work stands as the scenario is now."""
        return False

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

    def draw_slow_parts(self) -> None:  # noqa: B027 (most have nothing that takes long)
        """Draws what takes long, once nothing has changed for a moment; after `refresh`."""
