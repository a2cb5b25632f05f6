"""What a browser is told: short notes that need no panel."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

import viser
from viser import _messages

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
