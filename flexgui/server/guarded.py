"""viser's server with controlled access, down to its websockets, which hand on only what their
guard admits: all that reaches into viser 1.1.1's inside to do so."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import io
import logging
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import numpy.typing as npt
import viser
import websockets.asyncio.server as websocket_server
from viser import _assignable_props_api, _messages, infra
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed
from websockets.protocol import State

from flexgui.server.access import AccessHandler
from flexgui.server.errors import ReportingExecutor, Reports
from flexgui.server.guard import Guard, Rights
from flexgui.server.limits import Limits

CLOSE_TIMEOUT = 1.0
"""s that a browser may take to say goodbye; ten would outlast Ctrl-C."""
OPEN_TIMEOUT = 5.0
CALLBACK_THREADS = 32

NEVER = (
    _messages.ShareUrlRequest,
    _messages.ShareUrlDisconnect,
    _messages.GuiFormDirtyMessage,
)
"""Handlers taken away: a public tunnel, its end, and an unchecked message to all browsers."""

_BUILDING = threading.Lock()


def guarded_viser(
    listener: socket.socket, access: AccessHandler, rights: Rights, limits: Limits, reports: Reports
) -> viser.ViserServer:
    """A server on a socket that listens already. Nobody gets in until access is opened."""
    host, port = listener.getsockname()[:2]
    found: list[viser.ViserServer] = []
    options = _options(listener, access, _guard_maker(found, rights, limits), limits)
    # viser prints a box of its own, whatever `verbose` says.
    with _BUILDING, _served_with(options) as calls, contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host=host, port=port, label="FlexGUI", verbose=False)
    found.append(server)
    if not calls:
        stop(server)
        raise RuntimeError("viser did not start through FlexGUI's access; is it version 1.1.1?")
    inside = server._websock_server
    access.busy = lambda: len(inside._live_connections)
    for kind in NEVER:
        inside.unregister_handler(kind)
    _report_errors(server, reports)
    let_threads_send(server)
    keep_hints()
    return server


def stop(server: viser.ViserServer) -> None:
    """Ends it, without a word."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


def connection_of(server: viser.ViserServer, client_id: int) -> GuardedConnection | None:
    """The websocket of a browser; None where it has gone."""
    found = server._websock_server._live_connections.get(client_id)
    return found if isinstance(found, GuardedConnection) else None


def tolerate_leaving(client: viser.ClientHandle) -> None:
    """A browser may go while its page is drawn: viser's warning of that is no news."""
    client._websock_connection.get_message_buffer()._sanctioned_dead_writes += 1


@contextlib.contextmanager
def _served_with(options: dict[str, Any]) -> Iterator[list[bool]]:
    """viser starts its websocket server inside its constructor, by `serve`; options win."""
    original, calls = websocket_server.serve, list[bool]()

    def serve(handler: Any, host: Any, port: Any, **theirs: Any) -> Any:
        if calls:  # another server that happens to start now
            return original(handler, host, port, **theirs)
        calls.append(True)
        return original(handler, **{**theirs, **options})

    websocket_server.serve = serve  # type: ignore[assignment,misc]
    try:
        yield calls
    finally:
        websocket_server.serve = original  # type: ignore[misc]


def _options(
    listener: socket.socket,
    access: AccessHandler,
    make_guard: Callable[[GuardedConnection], Guard],
    limits: Limits,
) -> dict[str, Any]:
    return {
        "sock": listener,
        "process_request": access,
        # Asked again by websockets itself, should the handler ever forget.
        "origins": sorted(access.origins),
        "max_size": limits.message_bytes,
        "open_timeout": OPEN_TIMEOUT,
        "close_timeout": CLOSE_TIMEOUT,
        "server_header": None,
        "logger": _quiet_logger(),
        "create_connection": functools.partial(
            GuardedConnection, make_guard=make_guard, limits=limits
        ),
    }


def _guard_maker(
    found: list[viser.ViserServer], rights: Rights, limits: Limits
) -> Callable[[GuardedConnection], Guard]:
    def make(connection: GuardedConnection) -> Guard:
        (server,) = found  # access opens after construction only
        live = server._websock_server._live_connections
        client_id = next(number for number, each in list(live.items()) if each is connection)
        client = functools.partial(server._connected_clients.get, client_id)
        return Guard(client_id, client, rights, limits)

    return make


def _report_errors(server: viser.ViserServer, reports: Reports) -> None:
    """Callbacks on threads, `async` callbacks, and whatever else ends in the event loop."""
    old = server._thread_executor
    new = ReportingExecutor(CALLBACK_THREADS, reports)
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


def keep_hints() -> None:
    """viser writes `NDArray[np.float16]` and the like anew for each property that is set, which
    takes a tenth of the time of a drawing; here each is made once. Elsewhere nothing changes."""
    kinds = (np.float16, np.float32, np.float64, np.uint8)
    known = SimpleNamespace(NDArray={kind: npt.NDArray[kind] for kind in kinds})  # type: ignore[valid-type]
    _assignable_props_api.npt = known  # type: ignore[assignment]


class NewsEvent(asyncio.Event):
    """Wakes only who waits on its own event loop; elsewhere it is a flag.

    viser sets it from whatever thread sends, and then once more on the loop. `asyncio.Event` goes
    through its list of waiters each time; where the loop changes that list in this moment, the
    thread's drawing ended in "deque mutated during iteration", and was lost.
    """

    def set(self) -> None:
        """As on the loop, where it is called there."""
        self._value = True
        if asyncio._get_running_loop() is not None:
            for waiter in self._waiters:
                if not waiter.done():
                    waiter.set_result(True)


def let_threads_send(server: viser.ViserServer) -> None:
    """To all browsers together, and to each one that comes."""
    server._websock_server.get_message_buffer().message_event.__class__ = NewsEvent

    @server._websock_server.on_client_connect
    def _(connection: infra.WebsockClientConnection) -> None:
        connection.get_message_buffer().message_event.__class__ = NewsEvent


class _NoHandshakes(logging.Filter):
    """Every page, every refused visitor and every port scanner is a "failed" handshake."""

    def filter(self, record: logging.LogRecord) -> bool:
        text = record.getMessage()
        return not text.startswith(("opening handshake failed", "connection rejected"))


@functools.cache
def _quiet_logger() -> logging.Logger:
    logger = logging.getLogger("flexgui.websocket")
    logger.setLevel(logging.WARNING)
    logger.addFilter(_NoHandshakes())
    return logger


class Pace:
    """A bucket that leaks: nothing is thrown away, who talks too fast is heard later."""

    def __init__(self, per_second: float, burst: int, clock: Callable[[], float]) -> None:
        self._rate, self._burst, self._clock = per_second, burst, clock
        self._level, self._seen = 0.0, clock()

    def delay(self) -> float:
        """s to wait before the message that has just come is heard."""
        now = self._clock()
        self._level = max(self._level - (now - self._seen) * self._rate, 0.0) + 1.0
        self._seen = now
        return max(self._level - self._burst, 0.0) / self._rate


AHEAD = 64
"""Messages looked ahead: a hand sends 20 a second, so three seconds of a server that stood."""


class GuardedConnection(ServerConnection):
    """`recv` is the one place where viser gets messages from."""

    def __init__(
        self,
        *arguments: Any,
        make_guard: Callable[[GuardedConnection], Guard],
        limits: Limits,
        **options: Any,
    ) -> None:
        super().__init__(*arguments, **options)
        self._make_guard = make_guard
        self._guard: Guard | None = None
        self._talk = Pace(limits.messages_per_second, limits.burst, time.monotonic)
        self._ahead: deque[Any] = deque()

    async def recv(self, decode: bool | None = None) -> Any:
        """The next message that may change something, as bytes."""
        while True:
            raw = await self._newest(decode)
            assert self._guard is not None
            await asyncio.sleep(0.0)  # viser first does what the message before asked for
            admitted = await self._guard.admit(raw)
            if admitted is not None:
                return admitted

    async def _newest(self, decode: bool | None) -> Any:
        """The message that waits longest, but no position of a slider that has moved on since:
        who drags on a busy server would otherwise be answered later and later."""
        while True:
            if not self._ahead:
                self._ahead.append(await self._read(decode))
            while len(self.recv_messages.frames) and len(self._ahead) < AHEAD:
                try:
                    self._ahead.append(await self._read(decode))
                except ConnectionClosed:  # what came before counts; the next call hears of it
                    break
            raw = self._ahead.popleft()
            if not self._ahead or not self._has_moved_on(raw):
                return raw

    def _has_moved_on(self, raw: Any) -> bool:
        """Whether the next messages move the same slider again, and do nothing but move sliders."""
        assert self._guard is not None
        mine = self._guard.moves(raw)
        if not mine:
            return False
        for later in self._ahead:
            theirs = self._guard.moves(later)
            if theirs is None or theirs == mine:
                return theirs == mine
        return False

    async def _read(self, decode: bool | None) -> Any:
        raw = await super().recv(decode)
        if self._guard is None:
            self._guard = self._make_guard(self)
        # At least one turn for the others: refused messages may come without a pause.
        delay = self._talk.delay()
        await asyncio.sleep(delay if self.state is State.OPEN else 0.0)
        return raw
