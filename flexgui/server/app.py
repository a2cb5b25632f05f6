"""The server of the page: gives each browser that connects a session and a page."""

from __future__ import annotations

import contextlib
import logging
import socket
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import viser

from flexgui.core.errors import InputError
from flexgui.page.in_browser import remove_curtain, watch_connection
from flexgui.places import hide_paths
from flexgui.server.access import AccessHandler
from flexgui.server.browser_connection import FOLLOWER, STORED_AS, BrowserConnection, KeyRequests
from flexgui.server.demo import Demo
from flexgui.server.errors import ErrorReporter
from flexgui.server.options import host_name, loopback_origins, port_of
from flexgui.server.services import Limits
from flexgui.server.sessions import SessionStore
from flexgui.server.tickets import Tickets
from flexgui.server.viser_patches import (
    connection_of,
    guarded_viser,
    ignore_dead_writes,
    skip_plotly_upload,
    stop,
)
from flexgui.server.work_folders import SavedWorkFolders

if TYPE_CHECKING:
    from flexgui.page.page import Page
    from flexgui.server.warming import Warming
    from flexgui.session.session import Session

log = logging.getLogger("flexgui")

ADMISSION_THREADS = 16
"""Threads that wait for the keys of browsers and build their pages."""
SWEEP_SECONDS = 2.0


@dataclass(frozen=True)
class Settings:
    """The settings of a server."""

    make_session: Callable[[str, Path], Session]
    warming: Warming | None = None
    """Compiles in the background before the first page."""
    origins: tuple[str, ...] = ()
    """Allowed origins besides this machine's own."""
    tickets: Tickets | None = None
    """Requires the join code of a class."""
    demo: bool = False
    """Whether all other browsers follow the teacher."""
    kept: SavedWorkFolders | None = None
    """Folders for the work of sessions; None: it is not kept."""
    limits: Limits = Limits()


class PageServer:
    """Serves from construction until `close`, on a socket that is open already."""

    def __init__(self, listener: socket.socket, settings: Settings) -> None:
        self.port, self._name = port_of(listener), host_name(listener)
        self._settings = settings
        self.store = SessionStore(settings.make_session, settings.limits, settings.kept)
        self._demo = None
        if settings.demo:
            self._demo = Demo(self.store, self._show, first_is_teacher=settings.tickets is None)
        self._browsers: dict[int, BrowserConnection] = {}
        self._admission = ThreadPoolExecutor(ADMISSION_THREADS, thread_name_prefix="flexgui-access")
        self._key_requests = KeyRequests(settings.limits)
        self._ending = threading.Event()
        self._reports = ErrorReporter(log)
        origins = (*loopback_origins(self.port), *settings.origins)
        self._access = AccessHandler(origins, settings.limits, settings.tickets)
        self.viser = guarded_viser(
            listener, self._access, self._browsers, settings.limits, self._reports
        )
        self.viser.gui.configure_theme(show_logo=False, show_share_button=False)
        self._register_callbacks()
        self._sweeper = threading.Thread(target=self._sweep, name="flexgui-sweeper", daemon=True)
        self._sweeper.start()
        self._access.open = True

    @property
    def address(self) -> str:
        """The page's address for a browser on this machine."""
        return f"http://{self._name}:{self.port}/"

    @property
    def origins(self) -> tuple[str, ...]:
        """The origins of pages that may connect."""
        return tuple(sorted(self._access.origins))

    @property
    def idle(self) -> bool:
        """Whether no browser is connected."""
        return not self._browsers

    def close(self) -> None:
        """Ends every connection and every session; the job pool is the caller's."""
        self._access.open = False
        self._ending.set()
        stop(self.viser)
        self._admission.shutdown(wait=False, cancel_futures=True)
        for browser in list(self._browsers.values()):
            self._quietly(browser.end)
        self._quietly(self.store.close)

    def _register_callbacks(self) -> None:
        # Coroutines: they do not need one of the callbacks' threads.
        @self.viser.on_client_connect
        async def _(client: viser.ClientHandle) -> None:
            ignore_dead_writes(client)
            connection = connection_of(self.viser, client.client_id)
            if connection is None:  # it has left already
                return
            remote = connection.remote_address
            browser = BrowserConnection(client, str(remote[0]) if remote else "", self.store)
            browser.has_ticket = self._access.is_teacher(connection.request)
            self._browsers[client.client_id] = browser
            self._admission.submit(self._careful, self._arrive, browser)

        @self.viser.on_client_disconnect
        async def _(client: viser.ClientHandle) -> None:
            browser = self._browsers.pop(client.client_id, None)
            if browser is not None and not self._ending.is_set():
                self._admission.submit(self._careful, self._leave, browser)

    def _arrive(self, browser: BrowserConnection) -> None:
        welcome(browser.client)
        if self._settings.warming is not None:
            self._settings.warming.wait()
        key, browser.answered = self._key_requests.key_of(browser.client)
        try:
            if self._demo is not None:
                self._demo.arrive(browser, key)
            else:
                browser.take(self.store.join(key, address=browser.address))
                self._show(browser)
        except InputError as error:
            browser.client.gui.add_markdown(hide_paths(str(error)))
            remove_curtain(browser.client)
        if self._settings.warming is not None:
            self._settings.warming.page_is_shown()
        if browser.gone:
            self._forget(browser)

    def _show(self, browser: BrowserConnection) -> None:
        browser.show(lambda: self._build(browser))
        session = browser.session
        # The key of a browser that did not answer is not overwritten: a reload finds its work.
        if session is not None and browser.role != FOLLOWER and browser.answered:
            browser.client.local_storage.set_item(STORED_AS, session.key)

    def _build(self, browser: BrowserConnection) -> Page | None:
        from flexgui.page import page  # late: the server listens before it is there

        if self._demo is not None:
            self._demo.add_button(browser)
        if browser.session is None:
            remove_curtain(browser.client)
            return None
        if self._settings.warming is not None:
            self._settings.warming.add_client(browser.client)
        read_only = browser.role == FOLLOWER
        return page.build_page(browser.client, browser.session, read_only)

    def _leave(self, browser: BrowserConnection) -> None:
        browser.end()
        self._forget(browser)

    def _forget(self, browser: BrowserConnection) -> None:
        if self._demo is not None:
            self._demo.leave(browser)
        browser.release()

    def _sweep(self) -> None:
        while not self._ending.wait(SWEEP_SECONDS):
            self._quietly(self.store.sweep)

    def _careful(
        self, step: Callable[[BrowserConnection], None], browser: BrowserConnection
    ) -> None:
        try:
            step(browser)
        except Exception as error:
            if not self._ending.is_set():
                self._reports(error, browser.client)

    def _quietly(self, step: Callable[[], None]) -> None:
        """Reports an error of one step, so that the next step still runs."""
        with contextlib.suppress(InputError):
            try:
                step()
            except Exception as error:
                self._reports(error, None)


def welcome(client: viser.ClientHandle) -> None:
    """Sends every browser its first scripts, while its session and page are made."""
    watch_connection(client)
    skip_plotly_upload(client)
