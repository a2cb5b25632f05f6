"""The server of the page: browsers come, get a session and a page, and go."""

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

from flexgui.core.errors import InputError
from flexgui.page.in_browser import lift
from flexgui.places import without_places
from flexgui.server.access import AccessHandler
from flexgui.server.browser_connection import Asking, BrowserConnection, store_key
from flexgui.server.demo import Demo
from flexgui.server.entry import Word, loopback_origins, neighbours
from flexgui.server.errors import Reports
from flexgui.server.guarded import connection_of, guarded_viser, stop, tolerate_leaving
from flexgui.server.kept import new_root
from flexgui.server.limits import Limits
from flexgui.server.options import is_loopback, own_name, port_of
from flexgui.server.services import FOLLOWER, Services
from flexgui.server.store import Closable, Kept, SessionStore
from flexgui.server.values import folder_bytes

S = TypeVar("S", bound=Closable)

ADMISSION_THREADS = 16
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
        self._browsers: dict[int, BrowserConnection[S]] = {}
        self._admission = ThreadPoolExecutor(ADMISSION_THREADS, thread_name_prefix="flexgui-access")
        limits = settings.limits
        self._asking = Asking(limits.key_wait, limits.key_wait_longer, limits.asked_longer)
        self._ending = threading.Event()
        self._reports = Reports(self.log)
        origins = (*loopback_origins(self.port), *settings.origins)
        self._access = AccessHandler(
            origins, settings.limits, join=settings.join, teacher=settings.teacher,
            key=settings.key, clock=settings.clock,
        )  # fmt: skip
        self.viser = guarded_viser(listener, self._access, self, settings.limits, self._reports)
        self.viser.gui.configure_theme(show_logo=False, show_share_button=False)
        self._register_callbacks()
        self._sweeper = threading.Thread(target=self._sweep, name="flexgui-sweeper", daemon=True)
        self._sweeper.start()
        self._access.open = True

    @property
    def address(self) -> str:
        """For a browser on this machine."""
        return f"http://{self._name}:{self.port}/"

    @property
    def origins(self) -> tuple[str, ...]:
        """Of the pages that may connect."""
        return tuple(sorted(self._access.origins))

    def close(self) -> None:
        """Ends every connection and every session; the job pool is the caller's."""
        self._access.open = False
        self._ending.set()
        stop(self.viser)
        self._admission.shutdown(wait=False, cancel_futures=True)
        for browser in list(self._browsers.values()):
            self._quietly(browser.end)
        self._quietly(self.store.close)
        shutil.rmtree(self._root, ignore_errors=True)

    # What the guard asks, on the event loop.

    def may_act(self, client_id: int, uuid: str | None) -> bool:
        """Whether a browser may use a widget."""
        browser = self._browsers.get(client_id)
        return browser is not None and browser.may_use(uuid)

    def kept_bytes(self, client_id: int) -> int:
        """Of the files of a browser's session."""
        browser = self._browsers.get(client_id)
        session = None if browser is None else browser.session
        return 0 if session is None else folder_bytes(session.folder)

    def acted(self, client_id: int) -> None:
        """A browser is doing something in its session."""
        browser = self._browsers.get(client_id)
        if browser is not None and browser.session is not None and browser.role != FOLLOWER:
            self.store.touch(browser.session)

    # Coming and going.

    def _register_callbacks(self) -> None:
        # Coroutines, so that they neither wait for nor take one of the callbacks' threads.
        @self.viser.on_client_connect
        async def _(client: viser.ClientHandle) -> None:
            tolerate_leaving(client)
            browser = self._browsers[client.client_id] = BrowserConnection[S](
                client, self._address(client)
            )
            self._admission.submit(self._careful, self._arrive, browser)

        @self.viser.on_client_disconnect
        async def _(client: viser.ClientHandle) -> None:
            browser = self._browsers.pop(client.client_id, None)
            if browser is not None and not self._ending.is_set():
                self._admission.submit(self._careful, self._leave, browser)

    def _address(self, client: viser.ClientHandle) -> str:
        connection = connection_of(self.viser, client.client_id)
        remote = None if connection is None else connection.remote_address
        return neighbours(str(remote[0])) if remote else ""

    def _arrive(self, browser: BrowserConnection[S]) -> None:
        client = browser.client
        self._settings.welcome(client)
        key, browser.answered = self._asking.key_of(client)
        try:
            if self.demo is not None:
                self._arrive_in_demo(self.demo, browser, key)
            else:
                browser.session = self.store.join(key, address=browser.address)
                browser.counted = True
                self._show(browser)
        except InputError as error:
            client.gui.add_markdown(without_places(str(error)))
            lift(client)
        if browser.gone:
            self._forget(browser)

    def _arrive_in_demo(
        self, demo: Demo[S], browser: BrowserConnection[S], key: str | None
    ) -> None:
        connection = connection_of(self.viser, browser.client.client_id)
        if connection is None:
            return
        remote = connection.remote_address
        demo.arrive(
            browser,
            key,
            ticket=self._access.is_teacher(connection.request),
            loopback=bool(remote) and is_loopback(str(remote[0])),
        )

    def _show(self, browser: BrowserConnection[S]) -> None:
        browser.show(lambda: self._build(browser))
        session = browser.session
        # A key that a silent browser may have is not written over: a reload finds its work.
        if session is not None and browser.role != FOLLOWER and browser.answered:
            store_key(browser.client, session.key)

    def _build(self, browser: BrowserConnection[S]) -> Any:
        if self.demo is not None:
            self.demo.add_button(browser)
        if browser.session is None:
            lift(browser.client)
            return None
        read_only = browser.role == FOLLOWER
        return self._settings.build_page(browser.client, browser.session, self.services, read_only)

    def _leave(self, browser: BrowserConnection[S]) -> None:
        browser.end()
        self._forget(browser)

    def _forget(self, browser: BrowserConnection[S]) -> None:
        """Once, however coming and going met."""
        with browser.lock:
            counted, browser.counted = browser.counted, False
        if self.demo is not None:
            self.demo.leave(browser)
        if counted and browser.session is not None:
            self.store.leave(browser.session)

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

    def _careful(
        self, step: Callable[[BrowserConnection[S]], None], browser: BrowserConnection[S]
    ) -> None:
        try:
            step(browser)
        except Exception as error:
            if not self._ending.is_set():
                self._reports(error, browser.client)

    def _quietly(self, step: Callable[..., None], *arguments: Any) -> None:
        """The next one's turn comes whatever happens to this one."""
        with contextlib.suppress(InputError):
            try:
                step(*arguments)
            except Exception as error:
                self._reports(error, None)
