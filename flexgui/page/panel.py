"""The contract of a stage's panel, and the context that all elements of one page share."""

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
    """What the elements of one browser's page share: its client, its session, its theme."""

    client: viser.ClientHandle
    session: Session
    read_only: bool = False
    """For a follower, who sees everything and changes nothing: no callback is registered."""
    syncs: list[Callable[[], None]] = field(default_factory=list)
    """Functions that update one input each when the session has changed: those of the stage that is
    being built, later those of inputs outside the stages."""
    plot_area: PlotArea = field(default_factory=PlotArea)
    actions: Actions = field(default_factory=Actions)
    """The actions of buttons in the page's HTML."""

    def __post_init__(self) -> None:
        self.faults = Faults(lambda: self.session.notify(Topic.MESSAGE))
        """Faults of this page's own parts."""
        self.theme = Theme(self.client)

    @property
    def gui(self) -> viser.GuiApi:
        """The widgets of this browser."""
        return self.client.gui


class PageElement:
    """A group of widgets."""

    def __init__(self, context: PageContext) -> None:
        self.context = context

    @property
    def session(self) -> Session:
        """The session that the page shows."""
        return self.context.session

    @property
    def gui(self) -> viser.GuiApi:
        """The widgets of this browser."""
        return self.context.gui

    def enable(self, able: bool, *inputs: Any) -> None:
        """Enables or disables inputs; a follower's stay disabled."""
        for each in inputs:
            each.disabled = not able or self.context.read_only

    def send(self, name: str, content: bytes, without: str = "") -> None:
        """Sends a file to the browser; `without` is the reason why it has no recordings."""
        self.context.client.send_file_download(name, content, save_immediately=True)
        lacks = f", without recordings: {without}" if without else ""
        sentence = f"{name} was sent to your browser{lacks}"
        self.session.show_message(sentence.rstrip(".") + ".", bad=bool(without))


class Panel(PageElement, ABC):
    """Controls on the right, plots on the left; both are built once and then updated."""

    kind: ClassVar[str] = ""
    """The name of its stage."""
    topics: ClassVar[frozenset[Topic]] = frozenset()
    """Topics after which it is drawn again."""

    @property
    def done(self) -> bool:
        """Whether its work is done for the present scenario."""
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
        """Draws slow parts after `refresh`, once nothing has changed for a moment."""
