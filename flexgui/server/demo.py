"""A demo: the teacher's session, which others watch; server-side, they can change nothing."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

import viser

from flexgui.server.services import FOLLOWER, OWN, TEACHER
from flexgui.server.store import Closable, SessionStore
from flexgui.server.visits import Visit

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
        show: Callable[[Visit[S]], None],
        *,
        first_is_teacher: bool,
    ) -> None:
        """`copy(teacher, own)` fills a new session; `show(visit)` builds the visit's page."""
        self._store, self._copy, self._show = store, copy, show
        self._first_is_teacher = first_is_teacher
        self._lock = threading.RLock()
        self._visits: dict[int, Visit[S]] = {}
        self.session: S | None = None
        """The teacher's, once there is one."""

    def role(self, client: viser.ClientHandle) -> str:
        """ "teacher", "follower" or "own"."""
        visit = self._visits.get(client.client_id)
        return FOLLOWER if visit is None else visit.role

    def arrive(self, visit: Visit[S], key: str | None, *, ticket: bool, loopback: bool) -> None:
        """Gives the visit its role and its session, and shows it."""
        with self._lock:
            self._visits[visit.client.client_id] = visit
            first = self.session is None and self._first_is_teacher and loopback
            known = self.session is not None and key == self.session.key
            begins = False
            if ticket or first or known:
                begins = self.session is None
                self._as_teacher(visit, key)
            elif self._store.knows(key):
                self._as_own(visit, self._store.join(key, address=visit.address))
            else:
                visit.role, visit.session = FOLLOWER, self.session
        self._show(visit)
        if begins:
            for other in list(self._visits.values()):
                if other.role == FOLLOWER and other.session is None:
                    self._follow(other)

    def leave(self, visit: Visit[S]) -> None:
        """The browser has gone."""
        self._visits.pop(visit.client.client_id, None)

    def add_button(self, visit: Visit[S]) -> None:
        """How a follower comes to an own session, and back."""
        client = visit.client
        if visit.role == FOLLOWER:
            if visit.session is None:
                client.gui.add_markdown(WAITING)
                return
            button = client.gui.add_button(COPY, color="blue", order=ON_TOP)
            visit.allowed.add(button._impl.uuid)
            button.on_click(lambda _: self._take_copy(visit))
        elif visit.role == OWN:
            button = client.gui.add_button(FOLLOW, order=ON_TOP)
            button.on_click(lambda _: self._give_up(visit))

    def _as_teacher(self, visit: Visit[S], key: str | None) -> None:
        mine = self.session.key if self.session is not None else key
        visit.session = self._store.join(mine, pinned=True, address=visit.address)
        visit.role, visit.counted = TEACHER, True
        self.session = visit.session

    def _as_own(self, visit: Visit[S], session: S) -> None:
        visit.role, visit.session, visit.counted = OWN, session, True

    def _take_copy(self, visit: Visit[S]) -> None:
        with visit.lock:
            if visit.role != FOLLOWER or self.session is None or visit.gone:
                return
            own = self._store.join(None, address=visit.address)
            try:
                self._copy(self.session, own)
            except BaseException:
                self._store.leave(own)
                raise
            # The page goes before the role changes: its widgets belong to the teacher's session.
            visit.clear()
            self._as_own(visit, own)
        self._show(visit)

    def _give_up(self, visit: Visit[S]) -> None:
        with visit.lock:
            if visit.role != OWN or visit.gone:
                return
            own = visit.session
            self._follow(visit)
        if own is not None:
            self._store.leave(own)

    def _follow(self, visit: Visit[S]) -> None:
        """Rights first, page second: in between nothing of the teacher's can be changed."""
        visit.role, visit.counted = FOLLOWER, False
        visit.session = self.session
        self._show(visit)
