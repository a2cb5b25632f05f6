"""The connection of one browser window: which session is its own, its role, and the page built for
it."""

from __future__ import annotations

import contextlib
import logging
import re
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

import viser

from flexgui.server.options import is_loopback, neighbours
from flexgui.server.services import Limits
from flexgui.server.sessions import SessionStore, folder_bytes

if TYPE_CHECKING:
    from flexgui.page.page import Page
    from flexgui.session.session import Session

log = logging.getLogger(__name__)

TEACHER, FOLLOWER, OWN = "teacher", "follower", "own"


class BrowserConnection:
    """Of one browser window; its page may be exchanged while it lasts."""

    def __init__(self, client: viser.ClientHandle, remote: str, store: SessionStore) -> None:
        """`remote` is the network address that it came from."""
        self.client, self._store = client, store
        self.is_here = is_loopback(remote)
        """Whether it runs on this machine."""
        self.address = neighbours(remote)
        self.has_ticket = False
        """Whether it has brought the teacher's ticket."""
        self.role = OWN
        self.session: Session | None = None
        self._counted = False
        """Whether the store counts it as the session's browser."""
        self.answered = False
        """Whether it has said which session is its own, if any."""
        self.allowed: set[str] = set()
        """Widgets that a follower may use."""
        self.lock = threading.RLock()
        self._page: Page | None = None
        self._shown = False
        self.gone = False
        """Whether the browser has left."""

    def take(self, session: Session, role: str = OWN) -> None:
        """Goes on in a session that the store has given to it."""
        self.role, self.session, self._counted = role, session, True

    def follow(self, session: Session | None) -> None:
        """Looks at another one's session; what was its own is released by whoever knows it."""
        self.role, self.session, self._counted = FOLLOWER, session, False

    def release(self) -> None:
        """Its session has one browser less: once, however coming and going met."""
        with self.lock:
            counted, self._counted = self._counted, False
        if counted and self.session is not None:
            self._store.leave(self.session)

    def show(self, build: Callable[[], Page | None]) -> None:
        """Exchanges the page; nothing is built for who has left."""
        with self.lock:
            if self.gone:
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
            if self._shown and not self.gone:
                self.client.gui.reset()
                self.client.scene.reset()

    def end(self) -> None:
        """The browser has gone."""
        with self.lock:
            self.gone = True
            page, self._page = self._page, None
        if page is not None:
            page.close()

    # What the guard asks, on the event loop; without waiting for the lock.

    def may_use(self, uuid: str | None) -> bool:
        """Whether it may use a widget, or (None) something in the scene; a follower may use its
        own buttons only."""
        if self.role == FOLLOWER:
            return uuid in self.allowed
        return self.session is not None

    def acted(self) -> None:
        """Something is being done in its session."""
        if self.session is not None and self.role != FOLLOWER:
            self._store.touch(self.session)

    def kept_bytes(self) -> int:
        """Of the files of its session."""
        return 0 if self.session is None else folder_bytes(self.session.folder)


STORED_AS = "flexgui-session"
_KEY = re.compile(r"[\w-]{16,64}", re.ASCII)


class Asking:
    """Waits longer for a browser that does not answer at once, but for a few of them only: on a
    busy machine an answer takes its time, and whoever never answers must not keep others out."""

    def __init__(self, limits: Limits) -> None:
        self._at_once, self._longer = limits.key_wait, limits.key_wait_longer
        self._patience = threading.BoundedSemaphore(limits.asked_longer)

    def key_of(self, client: viser.ClientHandle) -> tuple[str | None, bool]:
        """Its key, if any, and whether it has answered: who has not may have one all the same."""
        with contextlib.suppress(TimeoutError):
            return _stored_key(client, self._at_once), True
        if not self._patience.acquire(blocking=False):
            return None, False
        try:
            return _stored_key(client, self._longer), True
        except TimeoutError:
            return None, False
        finally:
            self._patience.release()


def _stored_key(client: viser.ClientHandle, timeout: float) -> str | None:
    """What the browser kept; None where it kept nothing, TimeoutError where it does not answer."""
    try:
        key = client.local_storage.get_item(STORED_AS, timeout)
    except RuntimeError as error:
        log.debug("Client %d has no key: %s", client.client_id, error)
        return None
    return key if key is not None and _KEY.fullmatch(key) else None
