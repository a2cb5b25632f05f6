"""The messages that a browser may send: those of viser 1.1.1's client, with bounds of each field.

Three are left out and so refused: the two of the share button, and the one that viser passes to all
other browsers unchecked (`GuiFormDirtyMessage`).
"""

from __future__ import annotations

import sys
from typing import Annotated, Any, Literal, Union, cast

import msgspec
from msgspec import Meta

from flexgui.server.services import Limits

LARGEST_FLOAT = sys.float_info.max
Number = Annotated[float, Meta(ge=-LARGEST_FLOAT, le=LARGEST_FLOAT)]
"""A finite number."""
Pair = tuple[Number, Number]
Triple = tuple[Number, Number, Number]
Quadruple = tuple[Number, Number, Number, Number]
Name = Annotated[str, Meta(max_length=1000)]
"""An id, the name of a scene's node or of a file."""
Text = Annotated[str, Meta(max_length=Limits.text_length)]
Count = Annotated[int, Meta(ge=0, le=2**40)]
Bytes = Annotated[int, Meta(ge=0, le=2**60)]
Instance = Annotated[int, Meta(ge=0, le=2**31)]


class Message(msgspec.Struct, tag_field="type", tag=True, forbid_unknown_fields=True):
    """A message of a browser, which may change a session; its class name is its type."""

    @property
    def widget(self) -> str | None:
        """The id of the message's widget; None without one."""
        return None


class Passive(Message):
    """An answer or the browser's own view: it changes no session, and everybody may send it."""


class OfWidget(Message):
    """A message about a widget: pressed, sent or set."""

    uuid: Name

    @property
    def widget(self) -> str:
        return self.uuid


class Value(msgspec.Struct, forbid_unknown_fields=True):
    """The only property of a widget that a browser may set; the guard checks its value."""

    value: Any


class GuiUpdateMessage(OfWidget):
    """A widget's new value."""

    updates: Value


class GuiButtonHoldMessage(OfWidget):
    """A button is held down."""

    frequency: Number


class OfUpload(Message):
    """A message about an upload."""

    source_component_uuid: Name
    transfer_uuid: Name

    @property
    def widget(self) -> str:
        return self.source_component_uuid


class FileTransferStartUpload(OfUpload):
    """Announces a file."""

    filename: Name
    mime_type: Name
    part_count: Count
    size_bytes: Bytes


class FileTransferPart(OfUpload):
    """A part of an announced file."""

    part_index: Count
    content: bytes


_NODE = {"name": Name, "owner": (Name, "")}
_RAY = {"ray_origin": Triple | None, "ray_direction": Triple | None, "modifier": Name | None}
PASSED_ON: dict[str, tuple[type[Message], dict[str, Any]]] = {
    "ViewerCameraMessage": (Passive, {
        "wxyz": Quadruple, "position": Triple, "fov": Number, "near": Number, "far": Number,
        "image_height": Number, "image_width": Number, "look_at": Triple, "up_direction": Triple,
    }),
    "GetRenderResponseMessage": (Passive, {"payload": bytes, "render_uuid": Name}),
    "LocalStorageGetItemResponseMessage": (Passive, {
        "value": Text | None, "error": Text | None, "request_uuid": Name,
    }),
    "GuiFormSubmitMessage": (OfWidget, {}),
    "CommandTriggerMessage": (OfWidget, {}),
    "SceneNodeClickMessage": (Message, {
        **_NODE, **_RAY, "instance_index": Instance | None, "screen_pos": Pair,
    }),
    "SceneNodeDragMessage": (Message, {
        **_NODE, "phase": Literal["start", "update", "end"], "instance_index": Instance | None,
        "start_position": Triple, "start_screen_pos": Pair, "end_position": Triple,
        "end_screen_pos": Pair, "button": Literal["left", "middle", "right"],
        "modifier": Name | None,
    }),
    "ScenePointerMessage": (Message, {
        **_RAY, "event_type": Literal["click", "rect-select"],
        "screen_pos": Annotated[list[Pair], Meta(max_length=4)],
    }),
    "TransformControlsUpdateMessage": (Message, {
        **_NODE, "wxyz": Quadruple, "position": Triple,
    }),
    "TransformControlsDragStartMessage": (Message, _NODE),
    "TransformControlsDragEndMessage": (Message, _NODE),
}  # fmt: skip
"""Type -> its kind, and the fields that viser alone reads; (type, value): one with a default."""


def _struct(name: str, kind: type[Message], fields: dict[str, Any]) -> type[Message]:
    stated = [(key, *of) if isinstance(of, tuple) else (key, of) for key, of in fields.items()]
    return cast(type[Message], msgspec.defstruct(name, stated, bases=(kind,), kw_only=True))


_KINDS = [_struct(name, kind, fields) for name, (kind, fields) in PASSED_ON.items()]
_READ = (GuiUpdateMessage, GuiButtonHoldMessage, FileTransferStartUpload, FileTransferPart)
_DECODER = msgspec.msgpack.Decoder(Union[(*_READ, *_KINDS)])  # noqa: UP007


def decoded(raw: bytes) -> Message:
    """The message in a frame; ValueError if it is none or a field is out of bounds."""
    try:
        return _DECODER.decode(raw)
    except RecursionError as error:
        raise ValueError("deeper than any message") from error
