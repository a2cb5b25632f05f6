"""One browser window: its session, its role and its page."""

from __future__ import annotations

import contextlib
import logging
import re
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import viser

from flexgui.server.options import address_group, is_loopback
from flexgui.server.services import Limits
from flexgui.server.sessions import SessionStore
from flexgui.server.work_folders import folder_bytes

if TYPE_CHECKING:
    from flexgui.page.page import Page
    from flexgui.session.session import Session

log = logging.getLogger(__name__)

TEACHER, FOLLOWER, OWN = "teacher", "follower", "own"


@dataclass
class Upload:
    """A file that is announced and not whole yet: its bytes, and those that have not come."""

    size: int
    left: int


class BrowserConnection:
    """The connection of one browser window; its page may be replaced meanwhile."""

    def __init__(self, client: viser.ClientHandle, remote: str, store: SessionStore) -> None:
        """`remote` is the browser's network address."""
        self.client, self._store = client, store
        self.is_local = is_loopback(remote)
        """Whether it runs on this machine."""
        self.address = address_group(remote)
        self.has_ticket = False
        """Whether it has the teacher's ticket."""
        self.role = OWN
        self.session: Session | None = None
        self._counted = False
        """Whether the store counts it as a browser of the session."""
        self.answered = False
        """Whether it has sent the key of its session, or that it has none."""
        self.allowed: set[str] = set()
        """Widgets that a follower may use."""
        self.uploads: dict[str, Upload] = {}
        """Uploads under way, by id."""
        self.lock = threading.RLock()
        self._page: Page | None = None
        self._shown = False
        self.gone = False
        """Whether the browser has left."""

    def take(self, session: Session, role: str = OWN) -> None:
        """Works in a session of its own."""
        self.role, self.session, self._counted = role, session, True

    def follow(self, session: Session | None) -> None:
        """Follows another browser's session; the caller releases its own one before."""
        self.role, self.session, self._counted = FOLLOWER, session, False

    def release(self) -> None:
        """Removes the browser from its session's count, only once."""
        with self.lock:
            counted, self._counted = self._counted, False
        if counted and self.session is not None:
            self._store.leave(self.session)

    def show(self, build: Callable[[], Page | None]) -> None:
        """Replaces the page; builds none for a browser that has left."""
        with self.lock:
            if self.gone:
                return
            self.clear()
            self._shown = True
            self._page = build()

    def clear(self) -> None:
        """Removes the page and all its widgets."""
        with self.lock:
            page, self._page = self._page, None
            if page is not None:
                page.close()
            self.allowed.clear()
            if self._shown and not self.gone:
                self.client.gui.reset()
                self.client.scene.reset()

    def end(self) -> None:
        """The browser has left."""
        with self.lock:
            self.gone = True
            page, self._page = self._page, None
        if page is not None:
            page.close()

    # For the guard, on the event loop: these do not wait for the lock.

    def may_use(self, uuid: str | None) -> bool:
        """Whether it may use a widget, or (None) something in the scene; a follower may use its
        own buttons only."""
        if self.role == FOLLOWER:
            return uuid in self.allowed
        return self.session is not None

    def note_activity(self) -> None:
        """Notes that the person does something in the session."""
        if self.session is not None and self.role != FOLLOWER:
            self._store.touch(self.session)

    def kept_bytes(self) -> int:
        """Bytes of all files of its session."""
        return 0 if self.session is None else folder_bytes(self.session.folder)


STORED_AS = "flexgui-session"
_KEY = re.compile(r"[\w-]{16,64}", re.ASCII)


class KeyRequests:
    """Asks browsers for their session keys. Waits longer for a slow browser, but only for a few
    at a time: a browser that never answers must not keep others out."""

    def __init__(self, limits: Limits) -> None:
        self._at_once, self._longer = limits.key_wait, limits.key_wait_longer
        self._patience = threading.BoundedSemaphore(limits.asked_longer)

    def key_of(self, client: viser.ClientHandle) -> tuple[str | None, bool]:
        """The key, None without one, and whether the browser answered: else it may have a key."""
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
    """The key that the browser stores; None without one, TimeoutError without an answer."""
    try:
        key = client.local_storage.get_item(STORED_AS, timeout)
    except RuntimeError as error:
        log.debug("Client %d has no key: %s", client.client_id, error)
        return None
    return key if key is not None and _KEY.fullmatch(key) else None
