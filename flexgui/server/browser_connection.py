"""The connection of one browser window: its session, its role, and the page built for it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, Generic, Protocol, TypeVar

import viser

from flexgui.server.services import FOLLOWER, OWN
from flexgui.server.store import Closable

S = TypeVar("S", bound=Closable)


class Page(Protocol):
    """What `build_page` returns."""

    def close(self) -> None:
        """Take its widgets and threads away."""


class BrowserConnection(Generic[S]):
    """Of one browser window; its page may be exchanged while it lasts."""

    def __init__(self, client: viser.ClientHandle, address: str = "") -> None:
        self.client, self.address = client, address
        self.role = OWN
        self.session: S | None = None
        self.counted = False
        """Whether the store counts it as the session's browser."""
        self.answered = False
        """Whether it has said which session is its own, if any."""
        self.allowed: set[str] = set()
        """Widgets that a follower may use."""
        self.lock = threading.RLock()
        self._page: Page | None = None
        self._shown = False
        self._gone = False

    @property
    def gone(self) -> bool:
        """Whether the browser has left."""
        return self._gone

    def show(self, build: Callable[[], Any]) -> None:
        """Exchanges the page; nothing is built for who has left."""
        with self.lock:
            if self._gone:
                return
            self.clear()
            self._shown = True
            self._page = build()

    def clear(self) -> None:
        """Takes the page away, and every widget with it."""
        with self.lock:
            page, self._page = self._page, None
            if page is not None:
                page.close()
            self.allowed.clear()
            if self._shown and not self._gone:
                self.client.gui.reset()
                self.client.scene.reset()

    def end(self) -> None:
        """The browser has gone."""
        with self.lock:
            self._gone = True
            page, self._page = self._page, None
        if page is not None:
            page.close()

    def may_use(self, uuid: str | None) -> bool:
        """A follower may use its own buttons only; asked without waiting for the lock."""
        if self.session is None and self.role != FOLLOWER:
            return False
        return self.role != FOLLOWER or uuid in self.allowed
