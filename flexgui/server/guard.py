"""Every message of one browser passes here before viser sees it: kinds, fields, what each may be.

The kinds of messages are those that viser 1.1.1's own client sends, without the two of the share
button and the one that viser passes on to all other browsers (`GuiFormDirtyMessage`).
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import msgspec
import viser

from flexgui.server.errors import correct, drop_upload, explain, refuse_upload
from flexgui.server.limits import Limits
from flexgui.server.values import OverrunError, RefusedError, Transfers, checked, items, number

log = logging.getLogger(__name__)

_DECODE = msgspec.msgpack.Decoder()
SLIDERS = (viser.GuiSliderHandle, viser.GuiMultiSliderHandle)
UPLOAD = "FileTransferStartUpload"
_TARGETS = ("uuid", "source_component_uuid")


class Rights(Protocol):
    """What the connections may do; asked on the event loop, so all but `kept_bytes` is quick."""

    def may_act(self, client_id: int, uuid: str | None) -> bool:
        """Whether the browser may use a widget (None: something in the scene)."""

    def kept_bytes(self, client_id: int) -> int:
        """Of the files of the browser's session; on another thread, as it walks a folder."""

    def acted(self, client_id: int) -> None:
        """What the browser sends now is admitted, and may change its session."""


class Guard:
    """Of one connection. What it refuses changes nothing, and the connection goes on."""

    def __init__(
        self,
        client_id: int,
        client: Callable[[], viser.ClientHandle | None],
        rights: Rights,
        limits: Limits,
    ) -> None:
        self._client_id, self._client, self._rights = client_id, client, rights
        self._kept_bytes = 0
        self._transfers = Transfers(limits, lambda: self._kept_bytes)
        self._explained = False

    async def admit(self, raw: str | bytes) -> bytes | None:
        """What viser may read, None where it may not."""
        message: dict[str, Any] = {}
        try:
            message = check_fields(_decoded(raw))
            self._check_rights(message)
            if message["type"] == UPLOAD:
                self._kept_bytes = await asyncio.to_thread(self._rights.kept_bytes, self._client_id)
            rule = _RULES.get(message["type"])
            changed = rule is not None and rule(self, message)
        except RefusedError as refusal:
            self._refused(message, refusal)
            return None
        if message["type"] not in PASSIVE:
            self._rights.acted(self._client_id)
        assert isinstance(raw, bytes)
        return msgspec.msgpack.encode(message) if changed else raw

    def moves(self, raw: str | bytes) -> str | None:
        """The slider that a message moves to a place where it may be; "" for a message that changes
        nothing, None for any other one."""
        try:
            message = check_fields(_decoded(raw))
            if message["type"] in PASSIVE:
                return ""
            if message["type"] != "GuiUpdateMessage":
                return None
            handle = self._handle(message["uuid"])
            checked(handle, message["updates"]["value"])
        except RefusedError:
            return None
        uuid: str = message["uuid"]
        return uuid if isinstance(handle, SLIDERS) else None

    def _check_rights(self, message: dict[str, Any]) -> None:
        if message["type"] in PASSIVE:
            return
        target = next((message[name] for name in _TARGETS if name in message), None)
        if not self._rights.may_act(self._client_id, target):
            raise NoRightError("who follows changes nothing")

    def _handle(self, uuid: str) -> Any:
        """The input that a message is about; RefusedError where it may not be used."""
        client = self._client()
        found = None if client is None else client.gui._gui_input_handle_from_uuid.get(uuid)
        if found is None or found._impl.removed:
            raise RefusedError("no such widget")
        if getattr(found, "disabled", False):
            raise RefusedError("the widget is disabled")
        return found

    def _update(self, message: dict[str, Any]) -> bool:
        updates = message["updates"]
        accepted = checked(self._handle(message["uuid"]), updates["value"])
        changed: bool = accepted != updates["value"]
        updates["value"] = accepted
        return changed

    def _hold(self, message: dict[str, Any]) -> bool:
        self._handle(message["uuid"])
        return False

    def _begin_upload(self, message: dict[str, Any]) -> bool:
        handle = self._handle(message["source_component_uuid"])
        if not isinstance(handle, viser.GuiUploadButtonHandle):
            raise RefusedError("an upload to something that takes none")
        self._transfers.begin(message)
        return False

    def _part(self, message: dict[str, Any]) -> bool:
        self._transfers.part(message)
        return False

    def _refused(self, message: dict[str, Any], refusal: RefusedError) -> None:
        kind = message.get("type", "?")
        log.debug("Client %d, %s: %s", self._client_id, kind, refusal)
        client = self._client()
        if client is None:
            return
        if isinstance(refusal, OverrunError):
            drop_upload(client, refusal.transfer)
        elif kind == UPLOAD:
            sentence = str(refusal) if refusal.shown else "This page takes no files now."
            refuse_upload(client, message, sentence)
        elif isinstance(refusal, NoRightError):
            correct(client, message.get("uuid", ""))
            if not self._explained:
                self._explained = True
                explain(client)


class NoRightError(RefusedError):
    """The browser may only look."""


_RULES: dict[str, Callable[[Guard, dict[str, Any]], bool]] = {
    "GuiUpdateMessage": Guard._update,
    "GuiButtonHoldMessage": Guard._hold,
    UPLOAD: Guard._begin_upload,
    "FileTransferPart": Guard._part,
}
"""Each says whether it changed the message."""


def _decoded(raw: str | bytes) -> object:
    if isinstance(raw, str):
        raise RefusedError("text, where viser sends bytes")
    try:
        return _DECODE.decode(raw)
    except (ValueError, RecursionError) as error:  # also for text that is no UTF-8
        raise RefusedError("no MessagePack") from error


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
    UPLOAD: {
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
