"""Frozen records as bytes and back, by their types: msgpack beside arrays, never a pickle."""

from __future__ import annotations

import io
import zlib
from typing import Any, TypeVar

import msgspec
import numpy as np

from flexgui.core.errors import InputError
from flexgui.core.scenario.schema import Scenario
from flexgui.session.edit import text_of

SCHEMA = 2
"""Of the store. Fields may come and go within one: what is missing has its default."""
DAMAGED = "it is damaged, or an earlier version of FlexGUI wrote it."
T = TypeVar("T")


class Envelope(msgspec.Struct):
    """What a file holds after its checksum."""

    schema: int
    arrays: list[bytes]
    """In NumPy's own format; an array that several records hold is written once."""
    body: bytes


def packed(record: Any) -> bytes:
    """Of a data class of records, arrays, scenarios, texts and numbers; TypeError of anything
    else."""
    arrays: dict[int, np.ndarray] = {}
    places: dict[int, int] = {}

    def plain(value: Any) -> Any:
        if isinstance(value, np.ndarray):
            arrays.setdefault(id(value), value)
            return places.setdefault(id(value), len(places))
        if isinstance(value, np.generic):
            return value.item()
        if isinstance(value, Scenario):
            return text_of(value)
        raise TypeError(f"{type(value)} is no record that is kept")

    body = msgspec.msgpack.encode(record, enc_hook=plain)
    content = Envelope(SCHEMA, [_bytes_of(each) for each in arrays.values()], body)
    written = msgspec.msgpack.encode(content)
    return b"%08x" % zlib.crc32(written) + written


def unpacked(content: bytes, kind: type[T]) -> T:
    """The record of that type that was packed; InputError where the bytes are none, or those of
    another version of the program that this one cannot read."""
    if b"%08x" % zlib.crc32(content[8:]) != content[:8]:
        raise InputError(DAMAGED)
    try:
        envelope = msgspec.msgpack.decode(content[8:], type=Envelope)
        arrays = [np.load(io.BytesIO(each), allow_pickle=False) for each in envelope.arrays]
    except (msgspec.DecodeError, ValueError, EOFError) as error:
        raise InputError(DAMAGED) from error
    if envelope.schema != SCHEMA:
        raise InputError("another version of FlexGUI wrote it.")

    def made(wanted: type, value: Any) -> Any:
        if wanted is Scenario:
            return _scenario(value)
        if wanted is np.ndarray:
            return arrays[value]
        raise TypeError(f"{wanted} is no record that is kept")

    try:
        return msgspec.msgpack.decode(envelope.body, type=kind, dec_hook=made)
    except (msgspec.ValidationError, TypeError, IndexError) as error:
        cause = error.__cause__  # a setting that this version does not know
        known = isinstance(cause, InputError)
        raise InputError(str(cause) if known else "parts of it are missing.") from error


def _bytes_of(array: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, array, allow_pickle=False)
    return buffer.getvalue()


def _scenario(text: str) -> Scenario:
    from flexgui.core.scenario.read import parse_scenario

    return parse_scenario(text, "What was kept")
