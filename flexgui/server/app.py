"""The server of the page: visits come, get a session and a page, and go."""

from __future__ import annotations

import contextlib
import logging
import secrets
import shutil
import socket
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Generic, TypeVar

import viser

from core.errors import InputError
from flexgui.panels.curtain import lift
from flexgui.places import without_places
from flexgui.server.arrivals import Asking, store_key
from flexgui.server.binding import is_loopback, own_name, port_of
from flexgui.server.demo import Demo
from flexgui.server.door import Door
from flexgui.server.entry import Word, neighbours
from flexgui.server.errors import Reports
from flexgui.server.folders import new_root
from flexgui.server.guarded import connection_of, guarded_viser, stop, tolerate_leaving
from flexgui.server.limits import Limits
from flexgui.server.origins import loopback_origins
from flexgui.server.services import FOLLOWER, Services
from flexgui.server.store import Closable, Kept, SessionStore
from flexgui.server.transfers import folder_bytes
from flexgui.server.visits import Visit

S = TypeVar("S", bound=Closable)

DOORMEN = 16
"""Threads that wait for browsers to say their key, and build pages."""
SWEEP_SECONDS = 2.0


@dataclass(frozen=True)
class Settings(Generic[S]):
    """How a server is made; the functions let tests put in dummies."""

    make_session: Callable[[str, Path], S]
    build_page: Callable[[viser.ClientHandle, S, Services, bool], Any]
    """The last argument: whether the page is to be looked at only."""
    services: Services
    welcome: Callable[[viser.ClientHandle], None] = lambda client: None
    """What every browser gets at once, while its session and page are made."""
    stop_jobs: Callable[[S], None] = lambda session: None
    copy_session: Callable[[S, S], None] | None = None
    """Fills a follower's own session from the teacher's; given where there is a demo."""
    origins: tuple[str, ...] = ()
    """Besides those of this machine."""
    join: Word | None = None
    teacher: Word | None = None
    key: bytes = field(default_factory=lambda: secrets.token_bytes(32))
    """What tickets are made with."""
    kept: Kept | None = None
    """Where the work of sessions is kept; None: nowhere."""
    limits: Limits = Limits()
    clock: Callable[[], float] = time.monotonic


class PageServer(Generic[S]):
    """Serves from construction until `close`, on a socket that listens already."""

    def __init__(self, listener: socket.socket, settings: Settings[S]) -> None:
        self.port, self._name = port_of(listener), own_name(listener)
        self.limits, self._settings = settings.limits, settings
        self.log: logging.Logger = settings.services.log
        self._root = new_root()
        self.store: SessionStore[S] = SessionStore(
            settings.make_session,
            self._root,
            settings.limits,
            stop_jobs=self._stop_jobs,
            clock=settings.clock,
            kept=settings.kept,
        )
        self.demo = self._make_demo(first_is_teacher=settings.join is None)
        self.services = replace(settings.services, demo=self.demo)
        self._visits: dict[int, Visit[S]] = {}
        self._doormen = ThreadPoolExecutor(DOORMEN, thread_name_prefix="flexgui-door")
        limits = settings.limits
        self._asking = Asking(limits.key_wait, limits.key_wait_longer, limits.asked_longer)
        self._ending = threading.Event()
        self._reports = Reports(self.log)
        origins = (*loopback_origins(self.port), *settings.origins)
        self._door = Door(
            origins, settings.limits, join=settings.join, teacher=settings.teacher,
            key=settings.key, clock=settings.clock,
        )  # fmt: skip
        self.viser = guarded_viser(listener, self._door, self, settings.limits, self._reports)
        self.viser.gui.configure_theme(show_logo=False, show_share_button=False)
        self._listen()
        self._sweeper = threading.Thread(target=self._sweep, name="flexgui-sweeper", daemon=True)
        self._sweeper.start()
        self._door.open = True

    @property
    def address(self) -> str:
        """For a browser on this machine."""
        return f"http://{self._name}:{self.port}/"

    @property
    def origins(self) -> tuple[str, ...]:
        """Of the pages that may connect."""
        return tuple(sorted(self._door.origins))

    def close(self) -> None:
        """Ends every visit and every session; the job pool is the caller's."""
        self._door.open = False
        self._ending.set()
        stop(self.viser)
        self._doormen.shutdown(wait=False, cancel_futures=True)
        for visit in list(self._visits.values()):
            self._quietly(visit.end)
        self._quietly(self.store.close)
        shutil.rmtree(self._root, ignore_errors=True)

    # What the guard asks, on the event loop.

    def may_act(self, client_id: int, uuid: str | None) -> bool:
        """Whether a browser may use a widget."""
        visit = self._visits.get(client_id)
        return visit is not None and visit.may_use(uuid)

    def kept_bytes(self, client_id: int) -> int:
        """Of the files of a browser's session."""
        visit = self._visits.get(client_id)
        session = None if visit is None else visit.session
        return 0 if session is None else folder_bytes(session.folder)

    def acted(self, client_id: int) -> None:
        """A browser is doing something in its session."""
        visit = self._visits.get(client_id)
        if visit is not None and visit.session is not None and visit.role != FOLLOWER:
            self.store.touch(visit.session)

    # Coming and going.

    def _listen(self) -> None:
        # Coroutines, so that they neither wait for nor take one of the callbacks' threads.
        @self.viser.on_client_connect
        async def _(client: viser.ClientHandle) -> None:
            tolerate_leaving(client)
            visit = self._visits[client.client_id] = Visit[S](client, self._address(client))
            self._doormen.submit(self._careful, self._arrive, visit)

        @self.viser.on_client_disconnect
        async def _(client: viser.ClientHandle) -> None:
            visit = self._visits.pop(client.client_id, None)
            if visit is not None and not self._ending.is_set():
                self._doormen.submit(self._careful, self._leave, visit)

    def _address(self, client: viser.ClientHandle) -> str:
        connection = connection_of(self.viser, client.client_id)
        remote = None if connection is None else connection.remote_address
        return neighbours(str(remote[0])) if remote else ""

    def _arrive(self, visit: Visit[S]) -> None:
        client = visit.client
        self._settings.welcome(client)
        key, visit.answered = self._asking.key_of(client)
        try:
            if self.demo is not None:
                self._arrive_in_demo(self.demo, visit, key)
            else:
                visit.session = self.store.join(key, address=visit.address)
                visit.counted = True
                self._show(visit)
        except InputError as error:
            client.gui.add_markdown(without_places(str(error)))
            lift(client)
        if visit.gone:
            self._forget(visit)

    def _arrive_in_demo(self, demo: Demo[S], visit: Visit[S], key: str | None) -> None:
        connection = connection_of(self.viser, visit.client.client_id)
        if connection is None:
            return
        remote = connection.remote_address
        demo.arrive(
            visit,
            key,
            ticket=self._door.is_teacher(connection.request),
            loopback=bool(remote) and is_loopback(str(remote[0])),
        )

    def _show(self, visit: Visit[S]) -> None:
        visit.show(lambda: self._build(visit))
        session = visit.session
        # A key that a silent browser may have is not written over: a reload finds its work.
        if session is not None and visit.role != FOLLOWER and visit.answered:
            store_key(visit.client, session.key)

    def _build(self, visit: Visit[S]) -> Any:
        if self.demo is not None:
            self.demo.add_button(visit)
        if visit.session is None:
            lift(visit.client)
            return None
        read_only = visit.role == FOLLOWER
        return self._settings.build_page(visit.client, visit.session, self.services, read_only)

    def _leave(self, visit: Visit[S]) -> None:
        visit.end()
        self._forget(visit)

    def _forget(self, visit: Visit[S]) -> None:
        """Once, however coming and going met."""
        with visit.lock:
            counted, visit.counted = visit.counted, False
        if self.demo is not None:
            self.demo.leave(visit)
        if counted and visit.session is not None:
            self.store.leave(visit.session)

    # Housekeeping.

    def _make_demo(self, first_is_teacher: bool) -> Demo[S] | None:
        copy = self._settings.copy_session
        if copy is None:
            return None
        return Demo(self.store, copy, self._show, first_is_teacher=first_is_teacher)

    def _stop_jobs(self, session: S) -> None:
        self._quietly(self._settings.stop_jobs, session)

    def _sweep(self) -> None:
        while not self._ending.wait(SWEEP_SECONDS):
            self._quietly(self.store.sweep)

    def _careful(self, step: Callable[[Visit[S]], None], visit: Visit[S]) -> None:
        try:
            step(visit)
        except Exception as error:
            if not self._ending.is_set():
                self._reports(error, visit.client)

    def _quietly(self, step: Callable[..., None], *arguments: Any) -> None:
        """The next one's turn comes whatever happens to this one."""
        with contextlib.suppress(InputError):
            try:
                step(*arguments)
            except Exception as error:
                self._reports(error, None)
