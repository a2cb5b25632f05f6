"""All changes that FlexGUI makes inside viser 1.1.1 and its websocket server. Those of plotly.js
7.1.0 are in `page/in_browser.py`. Both versions are pinned; tests fail if a changed place moves.
"""

from __future__ import annotations

import asyncio
import contextlib
import functools
import io
import logging
import socket
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
import viser
import websockets.asyncio.server as websocket_server
from viser import _assignable_props_api, _messages, infra

from flexgui.server.access import AccessHandler
from flexgui.server.browser_connection import BrowserConnection
from flexgui.server.connection import GuardedConnection
from flexgui.server.errors import ErrorReporter
from flexgui.server.guard import Guard, Transfers
from flexgui.server.services import Limits

CLOSE_TIMEOUT = 1.0
"""s that a browser may take to close its connection."""
OPEN_TIMEOUT = 5.0
CALLBACK_THREADS = 32


def guarded_viser(
    listener: socket.socket,
    access: AccessHandler,
    browsers: Mapping[int, BrowserConnection],
    limits: Limits,
    reports: ErrorReporter,
) -> viser.ViserServer:
    """A viser server on an open socket. It refuses everybody until access is opened. RuntimeError
    where viser started otherwise, as another version of it may."""
    host, port = listener.getsockname()[:2]
    options = {
        "sock": listener,
        "process_request": access,
        # Checked again by websockets itself.
        "origins": sorted(access.origins),
        "max_size": limits.message_bytes,
        "open_timeout": OPEN_TIMEOUT,
        "close_timeout": CLOSE_TIMEOUT,
        "server_header": None,
        "logger": _quiet_logger(),
        "create_connection": functools.partial(GuardedConnection, limits=limits),
    }
    # viser prints a box of its own, whatever `verbose` says.
    with _served_with(options) as calls, contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host=host, port=port, label="FlexGUI", verbose=False)
    if not calls:
        stop(server)
        raise RuntimeError("viser did not start through FlexGUI's access; is it version 1.1.1?")
    inside = server._websock_server
    access.busy = lambda: len(inside._live_connections)
    for kind in REMOVED_HANDLERS:
        inside.unregister_handler(kind)

    transfers = Transfers(limits, browsers)

    @inside.on_client_connect
    def _(connection: infra.WebsockClientConnection) -> None:
        number = connection.client_id
        guarded = connection_of(server, number)
        assert guarded is not None
        guarded.guard = Guard(functools.partial(browsers.get, number), transfers)

    report_errors(server, reports)
    make_events_thread_safe(server)
    cache_type_hints()
    return server


def stop(server: viser.ViserServer) -> None:
    """Stops the server; suppresses viser's own message."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


def connection_of(server: viser.ViserServer, client_id: int) -> GuardedConnection | None:
    """The websocket of a browser; None if it has left."""
    connection = server._websock_server._live_connections.get(client_id)
    return connection if isinstance(connection, GuardedConnection) else None


REMOVED_HANDLERS = (
    _messages.ShareUrlRequest,
    _messages.ShareUrlDisconnect,
    _messages.GuiFormDirtyMessage,
)
"""Removed handlers: a public tunnel, its end, and an unchecked message to all browsers."""

_BUILDING = threading.Lock()


@contextlib.contextmanager
def _served_with(options: dict[str, Any]) -> Iterator[list[bool]]:
    """Makes viser's constructor call `serve` of websockets with our options: without them anybody
    could connect."""
    original, calls = websocket_server.serve, list[bool]()

    def serve(handler: Any, host: Any, port: Any, **defaults: Any) -> Any:
        if calls:  # another server that happens to start now
            return original(handler, host, port, **defaults)
        calls.append(True)
        return original(handler, **{**defaults, **options})

    with _BUILDING:
        websocket_server.serve = serve  # type: ignore[assignment,misc]
        try:
            yield calls
        finally:
            websocket_server.serve = original  # type: ignore[misc]


@functools.cache
def _quiet_logger() -> logging.Logger:
    """A logger without "failed" handshakes: every page and every refused request is one."""
    silent = ("opening handshake failed", "connection rejected")
    logger = logging.getLogger("flexgui.websocket")
    logger.setLevel(logging.WARNING)
    logger.addFilter(lambda record: not record.getMessage().startswith(silent))
    return logger


def ignore_dead_writes(client: viser.ClientHandle) -> None:
    """Suppresses viser's warning for a browser that leaves while its page is drawn."""
    client._websock_connection.get_message_buffer()._sanctioned_dead_writes += 1


def report_errors(server: viser.ViserServer, reports: ErrorReporter) -> None:
    """Sends errors of callbacks to `reports`: viser only prints them."""
    old = server._thread_executor
    new = CallbackExecutor(reports)
    server._thread_executor = server.gui._thread_executor = new
    server.scene._thread_executor = new
    old.shutdown(wait=False)
    loop = server.get_event_loop()
    loop.call_soon_threadsafe(loop.set_exception_handler, reports.of_loop)

    @server._websock_server.on_client_connect
    def _(connection: infra.WebsockClientConnection) -> None:
        inner = connection._handle_incoming_message

        async def careful(client_id: Any, message: Any) -> None:
            try:
                await inner(client_id, message)
            except Exception as error:
                reports(error, server._connected_clients.get(client_id))

        connection._handle_incoming_message = careful  # type: ignore[method-assign]


class CallbackExecutor(ThreadPoolExecutor):
    """viser queues a callback for every position of a slider, and answers a fast hand later and
    later. Here a callback of an input that runs or waits is only noted to run once more: it reads
    the input's value when it runs, so the newest wins before the queue, and values are never taken
    in another order than they came."""

    def __init__(self, reports: ErrorReporter) -> None:
        super().__init__(CALLBACK_THREADS, thread_name_prefix="flexgui-callback")
        self._reports = reports
        self._again: dict[_Mark, bool] = {}
        """Inputs whose callback runs: whether a newer value has come."""
        self._lock = threading.Lock()

    def submit(
        self, function: Callable[..., Any], /, *arguments: Any, **options: Any
    ) -> Future[Any]:
        """As in the base class, but the future never ends in an error."""

        def careful() -> Any:
            try:
                return function(*arguments, **options)
            except Exception as error:
                self._reports(error, _client_of(arguments))
                return None

        # Clicks and files have no value: all of them count.
        target = getattr(arguments[0], "target", None) if arguments else None
        if not isinstance(target, viser.GuiInputHandle):
            return super().submit(careful)
        mark = function, target._impl.uuid
        with self._lock:
            runs = mark in self._again
            self._again[mark] = runs
        if not runs:
            return super().submit(self._run, mark, careful)
        noted: Future[Any] = Future()
        noted.set_result(None)
        return noted

    def _run(self, mark: _Mark, work: Callable[[], Any]) -> None:
        """Runs the callback until no newer value has come."""
        while True:
            with self._lock:  # before the value is read: what comes from now on is newer
                self._again[mark] = False
            work()
            with self._lock:
                if not self._again[mark]:
                    del self._again[mark]
                    return


_Mark = tuple[object, str]
"""A callback and the input that it is of."""


def _client_of(arguments: tuple[Any, ...]) -> viser.ClientHandle | None:
    """The browser of an event or a camera, or the argument itself."""
    for argument in arguments:
        for candidate in (argument, getattr(argument, "client", None)):
            if isinstance(candidate, viser.ClientHandle):
                return candidate
    return None


def cache_type_hints() -> None:
    """viser writes `NDArray[np.float16]` and the like again for each property that is set, which
    takes a tenth of the time of a drawing; here each is made once. Elsewhere nothing changes."""
    kinds = (np.float16, np.float32, np.float64, np.uint8)
    cached = SimpleNamespace(NDArray={kind: npt.NDArray[kind] for kind in kinds})  # type: ignore[valid-type]
    _assignable_props_api.npt = cached  # type: ignore[assignment]


class ThreadSafeEvent(asyncio.Event):
    """Wakes only who waits on its own event loop; elsewhere it is a flag.

    viser sets it from whatever thread sends, and then once more on the loop. `asyncio.Event` goes
    through its list of waiters each time; where the loop changes that list in this moment, the
    thread's drawing ended in "deque mutated during iteration", and was lost.
    """

    def set(self) -> None:
        """Sets the flag; wakes the waiters only on the event loop."""
        self._value = True
        if asyncio._get_running_loop() is not None:
            for waiter in self._waiters:
                if not waiter.done():
                    waiter.set_result(True)


def make_events_thread_safe(server: viser.ViserServer) -> None:
    """Replaces the events of the server's and of each connection's message buffer."""
    server._websock_server.get_message_buffer().message_event.__class__ = ThreadSafeEvent

    @server._websock_server.on_client_connect
    def _(connection: infra.WebsockClientConnection) -> None:
        connection.get_message_buffer().message_event.__class__ = ThreadSafeEvent


def skip_plotly_upload(client: viser.ClientHandle) -> None:
    """viser sends plotly.js with the first plot of a page; ours has it already (`/plotly.js`)."""
    client.gui._setup_plotly_js = True
