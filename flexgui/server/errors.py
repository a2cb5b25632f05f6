"""What goes wrong in a page's callbacks: logged once, said in one short note, never the end."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import threading
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

import viser
from viser import _messages

from flexgui.core.errors import InputError
from flexgui.places import without_places

REMEMBERED = 500
"""Kinds of errors of which the first is logged in full."""

Report = Callable[[BaseException, viser.ClientHandle | None], None]


class Reports:
    """Takes every error that nobody caught."""

    def __init__(self, log: logging.Logger) -> None:
        self._log = log
        self._seen: set[tuple[str, str, int]] = set()

    def __call__(self, error: BaseException, client: viser.ClientHandle | None) -> None:
        if isinstance(error, InputError):
            sentence = without_places(str(error))
        else:
            self._write(error)
            sentence = (
                f"Something unexpected happened ({type(error).__name__}); your work is kept, and "
                "the details are in the server's log."
            )
        if client is not None:
            with contextlib.suppress(Exception):
                note(client, "That did not work", sentence, bad=True)

    def _write(self, error: BaseException) -> None:
        place = traceback.extract_tb(error.__traceback__)[-1:]
        where = (place[0].filename, place[0].lineno or 0) if place else ("", 0)
        key = (type(error).__name__, *where)
        if key in self._seen:
            self._log.debug("Again: %r", error)
            return
        if len(self._seen) < REMEMBERED:
            self._seen.add(key)
        self._log.error("A callback failed (logged once): %r", error, exc_info=error)

    def of_loop(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """The event loop's handler of errors."""
        error = context.get("exception")
        if error is None:
            self._log.debug("The event loop says: %s", context.get("message"))
        else:
            self(error, None)


class ReportingExecutor(ThreadPoolExecutor):
    """Runs viser's callbacks; their errors are reported to the browser that caused them.

    A callback of an input reads the input's value when it runs. While it runs or waits, however
    often the input changes, it is only noted that it has to run once more: the newest value wins
    before the queue, and values are never taken in another order than they came.
    """

    def __init__(self, threads: int, report: Report) -> None:
        super().__init__(threads, thread_name_prefix="flexgui-callback")
        self._report = report
        self._again: dict[_Mark, bool] = {}
        """Of the inputs that are at work: whether something newer has come."""
        self._lock = threading.Lock()

    def submit(
        self, function: Callable[..., Any], /, *arguments: Any, **options: Any
    ) -> Future[Any]:
        """As always, but the future never ends in an error."""

        def careful() -> Any:
            try:
                return function(*arguments, **options)
            except Exception as error:
                self._report(error, _client_of(arguments))
                return None

        mark = _mark(function, arguments)
        if mark is None:
            return super().submit(careful)
        with self._lock:
            if mark in self._again:
                self._again[mark] = True
                return _done()
            self._again[mark] = False
        return super().submit(self._until_newest, mark, careful)

    def _until_newest(self, mark: _Mark, work: Callable[[], Any]) -> None:
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


def _mark(function: Callable[..., Any], arguments: tuple[Any, ...]) -> _Mark | None:
    """Of the callback of an input with a value; None of a click or a file, which all count."""
    target = getattr(arguments[0], "target", None) if arguments else None
    return (function, target._impl.uuid) if isinstance(target, viser.GuiInputHandle) else None


def _done() -> Future[Any]:
    found: Future[Any] = Future()
    found.set_result(None)
    return found


def _client_of(arguments: tuple[Any, ...]) -> viser.ClientHandle | None:
    """Of an event, a camera, or the browser itself."""
    for argument in arguments:
        found = argument if isinstance(argument, viser.ClientHandle) else None
        found = found or getattr(argument, "client", None)
        if isinstance(found, viser.ClientHandle):
            return found
    return None


NOTE_SECONDS = 12.0
AFTER_ACK = 0.4
"""s: the page draws the end of an upload first, and the refusal over it."""


@contextlib.contextmanager
def _if_connected() -> Iterator[None]:
    """A browser that has just gone hears nothing, which is no error."""
    with contextlib.suppress(RuntimeError, KeyError):
        yield


def note(client: viser.ClientHandle, title: str, text: str, *, bad: bool = False) -> None:
    """A note in a corner of the page; the page shows it as plain text."""
    with _if_connected():
        client.add_notification(
            title, text, auto_close_seconds=NOTE_SECONDS, color="red" if bad else None
        )


def explain(client: viser.ClientHandle) -> None:
    """Why nothing happens when a follower moves something."""
    note(
        client,
        "You follow the teacher",
        "The teacher's stage can only be watched; take your own copy to change things.",
    )


def correct(client: viser.ClientHandle, uuid: str) -> None:
    """The page shows the server's value of a widget again."""
    handle = client.gui._gui_input_handle_from_uuid.get(uuid)
    if handle is None or not isinstance(handle, viser.GuiInputHandle):
        return
    with _if_connected():
        client._websock_connection.queue_message(
            _messages.GuiUpdateMessage(uuid, {"value": handle._impl.value})
        )


def refuse_upload(client: viser.ClientHandle, message: dict[str, Any], sentence: str) -> None:
    """Ends the page's own progress note of the upload and writes the reason into it."""
    transfer, size = message["transfer_uuid"], message["size_bytes"]
    refused = _messages.NotificationUpdateMessage(
        # The name that viser's client gives the note of an upload.
        f"upload-{transfer}",
        _messages.NotificationProps("File refused", sentence, False, True, NOTE_SECONDS, "red"),
    )

    def finish() -> None:
        with _if_connected():
            client._websock_connection.queue_message(refused)

    with _if_connected():
        # The button works again once everything has been acknowledged.
        client._websock_connection.queue_message(
            _messages.FileTransferPartAck(message["source_component_uuid"], transfer, size, size)
        )
        client.gui._event_loop.call_soon_threadsafe(
            client.gui._event_loop.call_later, AFTER_ACK, finish
        )


def drop_upload(client: viser.ClientHandle, transfer: str) -> None:
    """Forgets what has come of a file."""
    client.gui._current_file_upload_states.pop(transfer, None)
