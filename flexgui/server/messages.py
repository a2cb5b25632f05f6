"""What a browser may send: kinds of messages, their fields, and what each field may be.

The kinds are those that viser 1.1.1's own client sends, without the two of the share button and
the one that viser passes on to all other browsers (`GuiFormDirtyMessage`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from flexgui.server.limits import Limits
from flexgui.server.refusal import RefusedError
from flexgui.server.values import items, number

Check = Callable[[object], object]

NAME = 1000
"""Characters of an id, a scene node's name or a file's name."""


def text(limit: int = NAME) -> Check:
    """A text of at most `limit` characters."""

    def check(value: object) -> None:
        if not isinstance(value, str) or len(value) > limit:
            raise RefusedError("no text, or a long one")

    return check


def whole(high: int) -> Check:
    """0, 1, … high."""

    def check(value: object) -> None:
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= high:
            raise RefusedError("no whole number in its range")

    return check


def vector(n: int, each: Check = number) -> Check:
    """A list of n."""

    def check(value: object) -> None:
        for item in items(value, n):
            each(item)

    return check


def some(each: Check, most: int) -> Check:
    """A list of at most `most`."""

    def check(value: object) -> None:
        if not isinstance(value, list) or len(value) > most:
            raise RefusedError("no list, or a long one")
        for item in value:
            each(item)

    return check


def optional(inner: Check) -> Check:
    """None, or what `inner` takes."""

    def check(value: object) -> None:
        if value is not None:
            inner(value)

    return check


def one_of(*words: str) -> Check:
    """One of the words."""

    def check(value: object) -> None:
        if not isinstance(value, str) or value not in words:
            raise RefusedError("none of the words")

    return check


def _bytes(value: object) -> None:
    if not isinstance(value, bytes):
        raise RefusedError("no bytes")


def _only_a_value(value: object) -> None:
    if not isinstance(value, dict) or set(value) != {"value"}:
        raise RefusedError("a change of something else than the value")


_POINTER = {
    "ray_origin": optional(vector(3)),
    "ray_direction": optional(vector(3)),
    "modifier": optional(text()),
}
_NODE = {"name": text(), "owner": text()}

FIELDS: Mapping[str, Mapping[str, Check]] = {
    "ViewerCameraMessage": {
        "wxyz": vector(4), "position": vector(3), "fov": number, "near": number, "far": number,
        "image_height": number, "image_width": number,
        "look_at": vector(3), "up_direction": vector(3),
    },
    "GuiUpdateMessage": {"uuid": text(), "updates": _only_a_value},
    "GuiButtonHoldMessage": {"uuid": text(), "frequency": number},
    "GuiFormSubmitMessage": {"uuid": text()},
    "CommandTriggerMessage": {"uuid": text()},
    "FileTransferStartUpload": {
        "source_component_uuid": text(), "transfer_uuid": text(), "filename": text(),
        "mime_type": text(), "part_count": whole(2**40), "size_bytes": whole(2**60),
    },
    "FileTransferPart": {
        "source_component_uuid": text(), "transfer_uuid": text(), "part_index": whole(2**40),
        "content": _bytes,
    },
    "SceneNodeClickMessage": {
        **_NODE, **_POINTER, "instance_index": optional(whole(2**31)), "screen_pos": vector(2),
    },
    "SceneNodeDragMessage": {
        **_NODE, "phase": one_of("start", "update", "end"),
        "instance_index": optional(whole(2**31)), "start_position": vector(3),
        "start_screen_pos": vector(2), "end_position": vector(3), "end_screen_pos": vector(2),
        "button": one_of("left", "middle", "right"), "modifier": optional(text()),
    },
    "ScenePointerMessage": {
        **_POINTER, "event_type": one_of("click", "rect-select"),
        "screen_pos": some(vector(2), 4),
    },
    "TransformControlsUpdateMessage": {**_NODE, "wxyz": vector(4), "position": vector(3)},
    "TransformControlsDragStartMessage": _NODE,
    "TransformControlsDragEndMessage": _NODE,
    "GetRenderResponseMessage": {"payload": _bytes, "render_uuid": text()},
    "LocalStorageGetItemResponseMessage": {
        "value": optional(text(Limits.text_length)), "error": optional(text(Limits.text_length)),
        "request_uuid": text(),
    },
}  # fmt: skip

MAY_BE_LEFT_OUT = {"owner"}

PASSIVE = {
    "ViewerCameraMessage",
    "GetRenderResponseMessage",
    "LocalStorageGetItemResponseMessage",
}
"""Answers and the own view: they change nobody's session."""


def check_fields(message: object) -> dict[str, Any]:
    """The message, whose fields are all there and of their type; else RefusedError."""
    if not isinstance(message, dict) or not isinstance(message.get("type"), str):
        raise RefusedError("no message")
    fields = FIELDS.get(message["type"])
    if fields is None:
        raise RefusedError(f"a message {message['type'][:40]!r} that no page sends")
    given = {key for key in message if key != "type"}
    if not given <= set(fields) or not set(fields) - MAY_BE_LEFT_OUT <= given:
        raise RefusedError("fields that do not belong to the message, or too few")
    for name in given:
        fields[name](message[name])
    return message
