"""Converts frozen records to bytes and back by their types: msgpack and arrays, never pickle."""

from __future__ import annotations

import io
import zlib
from typing import Any, TypeVar

import msgspec
import numpy as np

from flexgui.core.errors import InputError
from flexgui.core.scenario.read import parse_scenario
from flexgui.core.scenario.schema import Scenario
from flexgui.session.scenario_edits import cached_text

SCHEMA_VERSION = 2
"""Of the saved files. Within one version fields may be added or removed: they have defaults."""
DAMAGED = "it is damaged, or an earlier version of FlexGUI wrote it."
T = TypeVar("T")


class Envelope(msgspec.Struct):
    """The content of a file after its checksum."""

    schema: int
    arrays: list[bytes]
    """In NumPy's own format; an array that several records hold is written once."""
    body: bytes


def serialize(record: Any) -> bytes:
    """The bytes of a data class of records, arrays, scenarios, texts and numbers; TypeError for
    anything else."""
    arrays: dict[int, np.ndarray] = {}
    places: dict[int, int] = {}

    def encode_other(value: Any) -> Any:
        if isinstance(value, np.ndarray):
            arrays.setdefault(id(value), value)
            return places.setdefault(id(value), len(places))
        if isinstance(value, np.generic):
            return value.item()
        if isinstance(value, Scenario):
            return cached_text(value)
        raise TypeError(f"{type(value)} is no record that is kept")

    body = msgspec.msgpack.encode(record, enc_hook=encode_other)
    content = Envelope(SCHEMA_VERSION, [_bytes_of(each) for each in arrays.values()], body)
    written = msgspec.msgpack.encode(content)
    return b"%08x" % zlib.crc32(written) + written


def deserialize(content: bytes, kind: type[T]) -> T:
    """The record of that type that was packed; InputError where the bytes are none, or those of
    another version of the program that this one cannot read."""
    if b"%08x" % zlib.crc32(content[8:]) != content[:8]:
        raise InputError(DAMAGED)
    try:
        envelope = msgspec.msgpack.decode(content[8:], type=Envelope)
        arrays = [np.load(io.BytesIO(each), allow_pickle=False) for each in envelope.arrays]
    except (msgspec.DecodeError, ValueError, EOFError):
        raise InputError(DAMAGED) from None
    if envelope.schema != SCHEMA_VERSION:
        raise InputError("another version of FlexGUI wrote it.")

    def decode_other(kind: type, value: Any) -> Any:
        if kind is Scenario:
            return parse_scenario(value, "What was kept")
        if kind is np.ndarray:
            return arrays[value]
        raise TypeError(f"{kind} is no record that is kept")

    try:
        return msgspec.msgpack.decode(envelope.body, type=kind, dec_hook=decode_other)
    except (msgspec.ValidationError, TypeError, IndexError) as error:
        cause = error.__cause__  # a setting that this version does not know
        is_sentence = isinstance(cause, InputError)
        raise InputError(str(cause) if is_sentence else "parts of it are missing.") from None


def _bytes_of(array: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, array, allow_pickle=False)
    return buffer.getvalue()
