"""What every panel of one browser works with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import viser

from flexgui.session import Services, Session


@dataclass(frozen=True)
class Desk:
    """One browser's page: its client, its session, what the server offers."""

    client: viser.ClientHandle
    session: Session
    services: Services
    read_only: bool = False
    """A follower sees everything and changes nothing: no callback is registered at all."""
    syncs: list[Callable[[], None]] = field(default_factory=list)
    """Called when the session changed: each brings one input up to date."""

    darkened: list[Callable[[bool], None]] = field(default_factory=list)
    """Called when the person turns the page dark or light."""

    @property
    def gui(self) -> viser.GuiApi:
        return self.client.gui
