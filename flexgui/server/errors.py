"""What goes wrong in a page's callbacks, logged once and said in one short note, never the end; and
what a browser is told of what its guard refused."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import traceback
from typing import Any

import viser
from viser import _messages

from flexgui.core.errors import InputError
from flexgui.places import without_places
from flexgui.server.messages import FileTransferStartUpload

REMEMBERED = 500
"""Kinds of errors of which the first is logged in full."""


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


NOTE_SECONDS = 12.0
AFTER_ACK = 0.4
"""s: the page draws the end of an upload first, and the refusal over it."""


GONE = (RuntimeError, KeyError)
"""What viser raises where a browser has just gone; it hears nothing, which is no error."""


def note(client: viser.ClientHandle, title: str, text: str, *, bad: bool = False) -> None:
    """A note in a corner of the page; the page shows it as plain text."""
    with contextlib.suppress(*GONE):
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
