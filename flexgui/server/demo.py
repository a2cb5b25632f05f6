"""A demo (`flexgui serve --demo`): the teacher's session, which others watch; server-side, they can
change nothing. Who takes a copy goes on in a session of its own."""

from __future__ import annotations

import contextlib
import shutil
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from flexgui.core.errors import InputError
from flexgui.server.browser_connection import FOLLOWER, OWN, TEACHER, BrowserConnection
from flexgui.server.sessions import SessionStore

if TYPE_CHECKING:
    from flexgui.session.session import Session

COPY = "Take my own copy"
FOLLOW = "Follow the teacher again"
ON_TOP = -1e9
"""Order of the button in the main panel."""
WAITING = "**The demo has not begun yet.** The teacher's stage appears here by itself."


class Demo:
    """Connects teacher and followers."""

    def __init__(
        self,
        store: SessionStore,
        show: Callable[[BrowserConnection], None],
        *,
        first_is_teacher: bool,
    ) -> None:
        """`show(browser)` builds the browser's page."""
        self._store, self._show = store, show
        self._first_is_teacher = first_is_teacher
        self._lock = threading.RLock()
        self._browsers: dict[int, BrowserConnection] = {}
        self.session: Session | None = None
        """The teacher's, once there is one."""

    def arrive(self, browser: BrowserConnection, key: str | None) -> None:
        """Gives a browser its role and session, and shows the session."""
        known = self._store.knows(key)
        with self._lock:
            self._browsers[browser.client.client_id] = browser
            first = self.session is None and self._first_is_teacher and browser.is_local
            is_teacher = self.session is not None and key == self.session.key
            begins = False
            if browser.has_ticket or first or is_teacher:
                begins = self.session is None
                mine = key if self.session is None else self.session.key
                self.session = self._store.join(mine, pinned=True, address=browser.address)
                browser.take(self.session, TEACHER)
            elif not known:
                browser.follow(self.session)
        if browser.role == OWN:  # no other browser waits until its session is made
            browser.take(self._store.join(key, address=browser.address))
        self._show(browser)
        if begins:
            for other in list(self._browsers.values()):
                if other.role == FOLLOWER and other.session is None:
                    self._follow(other)

    def leave(self, browser: BrowserConnection) -> None:
        """A browser has left."""
        self._browsers.pop(browser.client.client_id, None)

    def add_button(self, browser: BrowserConnection) -> None:
        """A follower's button for an own copy of the session, and back."""
        gui = browser.client.gui
        if browser.role == FOLLOWER and browser.session is None:
            gui.add_markdown(WAITING)
        elif browser.role == FOLLOWER:
            button = gui.add_button(COPY, color="blue", order=ON_TOP)
            browser.allowed.add(button._impl.uuid)
            button.on_click(lambda _: self._take_copy(browser))
        elif browser.role == OWN:
            button = gui.add_button(FOLLOW, order=ON_TOP)
            button.on_click(lambda _: self._give_up(browser))

    def _take_copy(self, browser: BrowserConnection) -> None:
        with browser.lock:
            if browser.role != FOLLOWER or self.session is None or browser.gone:
                return
            own = self._store.join(None, address=browser.address)
            try:
                copy_session(self.session, own)
            except BaseException:
                self._store.leave(own)
                raise
            # The page goes before the role changes: its widgets belong to the teacher's session.
            browser.clear()
            browser.take(own)
        self._show(browser)

    def _give_up(self, browser: BrowserConnection) -> None:
        with browser.lock:
            if browser.role != OWN or browser.gone:
                return
            own = browser.session
            self._follow(browser)
        if own is not None:
            self._store.leave(own)

    def _follow(self, browser: BrowserConnection) -> None:
        """Shows the teacher's session; read-only is set first."""
        browser.follow(self.session)
        self._show(browser)


def copy_session(teacher: Session, own: Session) -> None:
    """Copies scenario, files and results; the teacher's jobs are not copied."""
    from flexgui.session.state import Topic  # late: the server listens before it is there

    _copy_files(teacher.folder, own.folder)
    own.open(teacher.document.scenario)
    # Frozen records, which both may hold.
    own.identification.take(teacher.identification.outcome, teacher.identification.outcome_of)
    if teacher.challenge.state is None:
        own.diagnosis.versions = teacher.diagnosis.versions
        own.diagnosis.models.all = teacher.diagnosis.models.all
    else:
        own.challenge.take_up(teacher.challenge.state)
    own.document.live, own.stage = teacher.document.live, teacher.stage
    own.playback.cursor = replace(teacher.playback.cursor, playing=False)
    own.notify(Topic.OUTCOME, Topic.DIAGNOSIS, Topic.STAGE, Topic.CURSOR)
    own.document.refresh()
    own.playback.refresh()


def _copy_files(source: Path, target: Path) -> None:
    """Copies recordings only; links are not followed."""
    from flexgui.core.scenario.data_folder import ConfinedFolder

    for path in source.iterdir():
        with contextlib.suppress(InputError, FileNotFoundError):  # no recording, or gone meanwhile
            shutil.copyfile(ConfinedFolder(source).find(path.name), target / path.name)
