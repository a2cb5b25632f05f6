"""Reports errors of a page's callbacks, once in the log and as a note on the page, and what the
guard has refused."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import traceback
from typing import Any

import viser
from viser import _messages

from flexgui.core.errors import InputError
from flexgui.places import hide_paths
from flexgui.server.messages import FileTransferStartUpload

REMEMBERED = 500
"""Different errors that are each logged once in full."""


class ErrorReporter:
    """Called with every uncaught error."""

    def __init__(self, log: logging.Logger) -> None:
        self._log = log
        self._seen: set[tuple[str, str, int]] = set()

    def __call__(self, error: BaseException, client: viser.ClientHandle | None) -> None:
        if isinstance(error, InputError):
            sentence = hide_paths(str(error))
        else:
            self._write(error)
            sentence = (
                f"An internal error occurred ({type(error).__name__}). Your work is kept. "
                "The details are in the server's log."
            )
        if client is not None:
            with contextlib.suppress(Exception):
                show_note(client, "That did not work", sentence, bad=True)

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
        """The error handler of the event loop."""
        error = context.get("exception")
        if error is None:
            self._log.debug("The event loop says: %s", context.get("message"))
        else:
            self(error, None)


NOTE_SECONDS = 12.0
AFTER_ACK = 0.4
"""s: the page draws the end of an upload first, then the refusal."""


GONE = (RuntimeError, KeyError)
"""What viser raises where a browser has just left; that is no error."""


def show_note(client: viser.ClientHandle, title: str, text: str, *, bad: bool = False) -> None:
    """Shows a note of plain text in a corner of the page."""
    with contextlib.suppress(*GONE):
        client.add_notification(
            title, text, auto_close_seconds=NOTE_SECONDS, color="red" if bad else None
        )


def explain_following(client: viser.ClientHandle) -> None:
    """Shows a follower why an input has no effect."""
    show_note(
        client,
        "You follow the teacher",
        "You can only watch the teacher's stage. Take your own copy to change settings.",
    )


def restore_value(client: viser.ClientHandle, uuid: str) -> None:
    """Shows the server's value of a widget again."""
    handle = client.gui._gui_input_handle_from_uuid.get(uuid)
    if isinstance(handle, viser.GuiInputHandle):
        _send(client, _messages.GuiUpdateMessage(uuid, {"value": handle._impl.value}))


def refuse_upload(
    client: viser.ClientHandle, start: FileTransferStartUpload, sentence: str
) -> None:
    """Ends the page's own progress note of the upload and writes the reason into it."""
    transfer, size = start.transfer_uuid, start.size_bytes
    refused = _messages.NotificationUpdateMessage(
        # The name that viser's client gives the note of an upload.
        f"upload-{transfer}",
        _messages.NotificationProps("File refused", sentence, False, True, NOTE_SECONDS, "red"),
    )
    # The button works again once everything has been acknowledged.
    _send(
        client,
        _messages.FileTransferPartAck(start.source_component_uuid, transfer, size, size),
    )
    asyncio.get_running_loop().call_later(AFTER_ACK, _send, client, refused)


def _send(client: viser.ClientHandle, message: _messages.Message) -> None:
    with contextlib.suppress(*GONE):
        client._websock_connection.queue_message(message)
