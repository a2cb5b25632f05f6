"""The connection of one browser window: which session is its own, its role, and the page built for
it."""

from __future__ import annotations

import contextlib
import logging
import re
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


STORED_AS = "flexgui-session"
_KEY = re.compile(r"[\w-]{16,64}", re.ASCII)

log = logging.getLogger(__name__)


def stored_key(client: viser.ClientHandle, timeout: float) -> str | None:
    """What the browser kept; None where it kept nothing, TimeoutError where it does not answer."""
    try:
        key = client.local_storage.get_item(STORED_AS, timeout)
    except RuntimeError as error:
        log.debug("Client %d has no key: %s", client.client_id, error)
        return None
    return key if key is not None and _KEY.fullmatch(key) else None


class Asking:
    """Waits longer for a browser that does not answer at once, but for a few of them only: on a
    busy machine an answer takes its time, and whoever never answers must not keep others out."""

    def __init__(self, at_once: float, longer: float, most: int) -> None:
        """Times in s; `most` browsers are waited for longer."""
        self._at_once, self._longer = at_once, longer
        self._patience = threading.BoundedSemaphore(most)

    def key_of(self, client: viser.ClientHandle) -> tuple[str | None, bool]:
        """Its key, if any, and whether it has answered: who has not may have one all the same."""
        with contextlib.suppress(TimeoutError):
            return stored_key(client, self._at_once), True
        if not self._patience.acquire(blocking=False):
            return None, False
        try:
            return stored_key(client, self._longer), True
        except TimeoutError:
            return None, False
        finally:
            self._patience.release()


def store_key(client: viser.ClientHandle, key: str) -> None:
    """For the next time."""
    client.local_storage.set_item(STORED_AS, key)
