"""A demo: the teacher's session, which others watch; server-side, they can change nothing."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

import viser

from flexgui.server.browser_connection import BrowserConnection
from flexgui.server.services import FOLLOWER, OWN, TEACHER
from flexgui.server.store import Closable, SessionStore

S = TypeVar("S", bound=Closable)

COPY = "Take my own copy"
FOLLOW = "Follow the teacher again"
ON_TOP = -1e9
"""Order of the button in the main panel."""
WAITING = "**The demo has not begun yet.** The teacher's stage appears here by itself."


class Demo(Generic[S]):
    """Knows who is the teacher; a `DemoStage`."""

    def __init__(
        self,
        store: SessionStore[S],
        copy: Callable[[S, S], None],
        show: Callable[[BrowserConnection[S]], None],
        *,
        first_is_teacher: bool,
    ) -> None:
        """`copy(teacher, own)` fills a new session; `show(browser)` builds the browser's page."""
        self._store, self._copy, self._show = store, copy, show
        self._first_is_teacher = first_is_teacher
        self._lock = threading.RLock()
        self._browsers: dict[int, BrowserConnection[S]] = {}
        self.session: S | None = None
        """The teacher's, once there is one."""

    def role(self, client: viser.ClientHandle) -> str:
        """ "teacher", "follower" or "own"."""
        browser = self._browsers.get(client.client_id)
        return FOLLOWER if browser is None else browser.role

    def arrive(
        self, browser: BrowserConnection[S], key: str | None, *, ticket: bool, loopback: bool
    ) -> None:
        """Gives the browser its role and its session, and shows it."""
        with self._lock:
            self._browsers[browser.client.client_id] = browser
            first = self.session is None and self._first_is_teacher and loopback
            known = self.session is not None and key == self.session.key
            begins = False
            if ticket or first or known:
                begins = self.session is None
                self._as_teacher(browser, key)
            elif self._store.knows(key):
                self._as_own(browser, self._store.join(key, address=browser.address))
            else:
                browser.role, browser.session = FOLLOWER, self.session
        self._show(browser)
        if begins:
            for other in list(self._browsers.values()):
                if other.role == FOLLOWER and other.session is None:
                    self._follow(other)

    def leave(self, browser: BrowserConnection[S]) -> None:
        """The browser has gone."""
        self._browsers.pop(browser.client.client_id, None)

    def add_button(self, browser: BrowserConnection[S]) -> None:
        """How a follower comes to an own session, and back."""
        client = browser.client
        if browser.role == FOLLOWER:
            if browser.session is None:
                client.gui.add_markdown(WAITING)
                return
            button = client.gui.add_button(COPY, color="blue", order=ON_TOP)
            browser.allowed.add(button._impl.uuid)
            button.on_click(lambda _: self._take_copy(browser))
        elif browser.role == OWN:
            button = client.gui.add_button(FOLLOW, order=ON_TOP)
            button.on_click(lambda _: self._give_up(browser))

    def _as_teacher(self, browser: BrowserConnection[S], key: str | None) -> None:
        mine = self.session.key if self.session is not None else key
        browser.session = self._store.join(mine, pinned=True, address=browser.address)
        browser.role, browser.counted = TEACHER, True
        self.session = browser.session

    def _as_own(self, browser: BrowserConnection[S], session: S) -> None:
        browser.role, browser.session, browser.counted = OWN, session, True

    def _take_copy(self, browser: BrowserConnection[S]) -> None:
        with browser.lock:
            if browser.role != FOLLOWER or self.session is None or browser.gone:
                return
            own = self._store.join(None, address=browser.address)
            try:
                self._copy(self.session, own)
            except BaseException:
                self._store.leave(own)
                raise
            # The page goes before the role changes: its widgets belong to the teacher's session.
            browser.clear()
            self._as_own(browser, own)
        self._show(browser)

    def _give_up(self, browser: BrowserConnection[S]) -> None:
        with browser.lock:
            if browser.role != OWN or browser.gone:
                return
            own = browser.session
            self._follow(browser)
        if own is not None:
            self._store.leave(own)

    def _follow(self, browser: BrowserConnection[S]) -> None:
        """Rights first, page second: in between nothing of the teacher's can be changed."""
        browser.role, browser.counted = FOLLOWER, False
        browser.session = self.session
        self._show(browser)
