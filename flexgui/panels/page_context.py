"""What every panel of one browser works with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import viser

from flexgui.panels.theme import Theme
from flexgui.session import Services, Session


@dataclass(frozen=True)
class PageContext:
    """One browser's page: its client, its session, what the server offers."""

    client: viser.ClientHandle
    session: Session
    services: Services
    read_only: bool = False
    """A follower sees everything and changes nothing: no callback is registered at all."""
    syncs: list[Callable[[], None]] = field(default_factory=list)
    """Called when the session changed: each brings one input up to date."""

    theme: Theme = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "theme", Theme(self.client))

    @property
    def gui(self) -> viser.GuiApi:
        """The widgets of this browser."""
        return self.client.gui
