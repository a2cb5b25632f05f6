"""Converts frozen records to bytes and back by their types: msgpack and arrays, never pickle."""

from __future__ import annotations

import io
import zlib
from typing import Any, TypeVar

import msgspec
import numpy as np

from flexgui.core.bounded_cache import BoundedCache
from flexgui.core.errors import InputError
from flexgui.core.scenario.read import parse_scenario, scenario_toml
from flexgui.core.scenario.schema import Scenario

SCHEMA_VERSION = 2
"""Of the saved files. Within one version fields may be added or removed: they have defaults."""
DAMAGED = "it is damaged, or an earlier version of FlexGUI wrote it."
T = TypeVar("T")

_TEXTS: BoundedCache[tuple[Scenario, str]] = BoundedCache(64)
"""Keyed by the scenario's id, which stays unique while the entry holds the scenario: a session
saves the same scenarios again and again."""


class Envelope(msgspec.Struct):
    """The content of a file after its checksum."""

    schema: int
    arrays: list[bytes]
    """In NumPy's own format; equal arrays are written once."""
    body: bytes


def serialize(record: Any) -> bytes:
    """The bytes of a data class of records, arrays, scenarios, texts and numbers; TypeError for
    anything else."""
    held: dict[int, np.ndarray] = {}
    """By their ids, which stay unique while they are held."""
    places: dict[bytes, int] = {}
    """Content of an array -> its number, in the order of the file."""
    known: dict[int, int] = {}

    def encode_other(value: Any) -> Any:
        if isinstance(value, np.ndarray):
            if id(value) not in known:
                held[id(value)] = value
                known[id(value)] = places.setdefault(_bytes_of(value), len(places))
            return known[id(value)]
        if isinstance(value, np.generic):
            return value.item()
        if isinstance(value, Scenario):
            return _TEXTS.get(id(value), lambda: (value, scenario_toml(value)))[1]
        raise TypeError(f"{type(value)} is no record that is kept")

    body = msgspec.msgpack.encode(record, enc_hook=encode_other)
    content = Envelope(SCHEMA_VERSION, list(places), body)
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
