"""Bags of ROS: the fields of a message as columns, and the chunks of MCAP."""

from __future__ import annotations

import re
import struct
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np

from core.recording.reading import Reading

MOST_FIELDS = 200
"""Numbers of one message that are channels; a picture or a cloud of points has more."""
_REFERENCE = re.compile(r"ref|cmd|command|desired|target|setpoint|goal", re.IGNORECASE)
"""In a topic's name: what it says is wanted, not measured."""
_NUMBER = re.compile(r"\d+")
SECOND = 10**9
"""ns"""


class Flat(NamedTuple):
    """The numbers of one message."""

    names: tuple[str, ...]
    """Paths that begin with the topic."""
    values: list[float]
    stamp: int | None
    """ns, of the message's header."""


def flat(topic: str, message: Any) -> Flat | str:
    """The message's numbers, or why it has none that are channels.

    Args:
        topic: Its name without the first slash.
        message: As `rosbags` makes it: an object with fields.
    """
    header = getattr(message, "header", None)
    stamp = getattr(header, "stamp", None)
    ns = None if stamp is None else int(stamp.sec) * SECOND + int(stamp.nanosec)
    found: list[tuple[str, float]] = []
    if _is_joint_state(message):
        found = _joints(topic, message)
    elif not _collect(topic, message, found):
        return f"has more than {MOST_FIELDS} numbers per message"
    if not found:
        return "holds no numbers"
    return Flat(tuple(name for name, _ in found), [value for _, value in found], ns or None)


def _is_joint_state(message: Any) -> bool:
    return all(hasattr(message, name) for name in ("name", "position", "velocity", "effort"))


def _joints(topic: str, message: Any) -> list[tuple[str, float]]:
    """Fields of each joint, by its name and never by its place in the message."""
    wanted = _REFERENCE.search(topic) is not None
    names = [str(name) for name in message.name]
    numbers = _joint_numbers(names)
    found = []
    for field in ("position", "velocity", "effort"):
        values = getattr(message, field)
        for name, number, value in zip(names, numbers, values, strict=len(values) > 0):
            channel = _channel(field, number, wanted)
            path = f"{topic}/{name}/{field}"
            found.append((f"{path}/{channel}" if channel else path, float(value)))
    return sorted(found)


def _joint_numbers(names: list[str]) -> list[int | None]:
    """The joint (from 1) that each name means by its last number; None where that is not plain."""
    last = [int(found[-1]) if (found := _NUMBER.findall(name)) else None for name in names]
    if None in last or len(set(last)) < len(last):
        return [None] * len(names)
    first = 1 if 0 in last else 0  # some count joints from 0
    return [number + first for number in last if number is not None]


def _channel(field: str, joint: int | None, wanted: bool) -> str:
    if joint is None:
        return ""
    if field == "position":
        return f"theta{joint}_ref" if wanted else f"theta{joint}"
    if field == "velocity":
        return f"dtheta{joint}_ref" if wanted else ""
    return "" if wanted else f"u{joint}"


def _collect(path: str, value: Any, found: list[tuple[str, float]]) -> bool:
    """Adds the numbers below `value`; False where there are too many."""
    if isinstance(value, bool | int | float | np.number):
        found.append((path, float(value)))
    elif isinstance(value, np.ndarray | list | tuple):
        if len(value) > MOST_FIELDS:
            return False
        for k, each in enumerate(value):
            if not _collect(f"{path}{k + 1}", each, found):
                return False
    elif hasattr(value, "__dataclass_fields__"):
        for name in value.__dataclass_fields__:
            if name in ("header", "layout") or name.startswith("__"):
                continue
            here = path if name == "data" else f"{path}/{name}"
            if not _collect(here, getattr(value, name), found):
                return False
    return len(found) <= MOST_FIELDS


_CHUNK = 0x06
_SIGNATURE = 8
_RECORD = struct.Struct("<BQ")
_CHUNK_HEAD = struct.Struct("<QQQI")
PIECE = 1_000_000
"""Bytes that are unpacked at once."""


def count_unpacked(path: Path, reading: Reading) -> None:
    """Unpack each chunk in pieces that are thrown away.

    A chunk states its size, but what it unpacks to may be another one.

    Raises:
        InputError: More than a recording may have.
        ValueError: A record is longer than the file, or compressed in an unknown way.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        file.seek(_SIGNATURE)
        while len(head := file.read(_RECORD.size)) == _RECORD.size:
            kind, length = _RECORD.unpack(head)
            end = file.tell() + length
            if end > size:
                # The signature at the end is shorter than a record's head.
                raise ValueError("a record is longer than the file")
            if kind == _CHUNK:
                _count_chunk(file, end, reading)
                reading.took(end)
            file.seek(end)


def _count_chunk(file: IO[bytes], end: int, reading: Reading) -> None:
    _CHUNK_HEAD.unpack(file.read(_CHUNK_HEAD.size))
    (length,) = struct.unpack("<I", file.read(4))
    if length > end - file.tell():
        raise ValueError("a chunk's compression has too long a name")
    method = file.read(length).decode("utf-8", "replace")
    (packed,) = struct.unpack("<Q", file.read(8))
    if packed > end - file.tell():
        raise ValueError("a chunk is longer than its record")
    if method:
        _unpack(_decompressor(method), file.read(packed), reading)
    else:
        reading.grew(packed)


def _unpack(decompressor: Any, data: bytes, reading: Reading) -> None:
    while not decompressor.eof:
        piece = decompressor.decompress(data, PIECE)
        data = b""
        reading.grew(len(piece))
        if not piece and decompressor.needs_input:
            return


def _decompressor(method: str) -> Any:
    if method == "lz4":
        from lz4.frame import LZ4FrameDecompressor

        return LZ4FrameDecompressor()
    if method == "zstd":
        from backports.zstd import ZstdDecompressor

        return ZstdDecompressor()
    raise ValueError(f"the compression {method} is not known")
