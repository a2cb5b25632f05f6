"""MCAP files and bags of ROS 2 (db3): topics, one group each."""

from __future__ import annotations

import re
import sqlite3
import struct
import sys
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...recording.signals import Group, merged
from ...recording.table import Reading, Table, TableReader

if TYPE_CHECKING:
    from rosbags.interfaces import Connection
    from rosbags.typesys.store import Typestore


MCAP, SQLITE = b"\x89MCAP0\r\n", b"SQLite format 3\x00"
NANO = 1e-9
ZSTD = "backports.zstd"
"""The standard library's `compression.zstd`, for a Python that does not have it yet."""


class RosbagReader(TableReader):
    """One file of a bag; the header's stamp of a message is its time, else when it was logged."""

    kind = ".mcap .db3"
    file_type = "a bag of ROS 2"
    needs = ("rosbags",)

    def fits(self, path: Path, start: bytes) -> int:
        return int(start.startswith((MCAP, SQLITE)))

    def read(self, path: Path, reading: Reading) -> Table:
        reading.grew(path.stat().st_size)
        topics = _topics(path, reading)
        starts = [topic.first for topic in topics if topic.times]
        groups, unusable = [], {}
        for topic in topics:
            if topic.fault:
                unusable[topic.name] = topic.fault
            elif topic.times:
                groups.append(topic.group(min(starts)))
        return merged(path, groups, reading, unusable)


class _Topic:
    """What one topic has brought so far."""

    def __init__(self, name: str) -> None:
        self.name = name.strip("/")
        self.times: list[int] = []
        self.rows: list[list[float]] = []
        self.layout: tuple[str, ...] = ()
        self.fault = ""

    @property
    def first(self) -> int:
        """ns"""
        return min(self.times)

    def add(self, logged: int, message: Flat) -> None:
        if not self.layout:
            self.layout = message.names
        if message.names != self.layout:
            self.fault = "changes its fields from message to message"
            return
        self.times.append(logged if message.stamp is None else message.stamp)
        self.rows.append(message.values)

    def group(self, start: int) -> Group:
        # Whole numbers of ns, taken apart before they lose digits: 1.7e18 has more than a double.
        time = np.array([ns - start for ns in self.times], dtype=float) * NANO
        values = np.array(self.rows, dtype=float).reshape(len(self.times), -1)
        columns = {name: values[:, k] for k, name in enumerate(self.layout)}
        return Group(self.name, columns, time)


class _Storage(NamedTuple):
    connections: list[Connection]
    messages: Callable[..., Iterator[tuple[Connection, int, bytes]]]
    close: Callable[[], None]


def _storage(path: Path, reading: Reading) -> _Storage:
    from rosbags.rosbag2.storage_mcap import McapReader
    from rosbags.rosbag2.storage_sqlite3 import Sqlite3Reader

    with path.open("rb") as file:
        mcap = file.read(len(MCAP)) == MCAP
    if mcap:
        count_unpacked(path, reading)
    else:
        _check_database(path, reading)
    reader: Any = McapReader(path) if mcap else Sqlite3Reader(path)
    reader.open()
    return _Storage(reader.connections, reader.messages, reader.close)


def _check_database(path: Path, reading: Reading) -> None:
    with sqlite3.connect(f"file:{path}?immutable=1", uri=True) as database:
        (rows,) = database.execute("SELECT COUNT(*) FROM messages").fetchone()
        reading.holds(int(rows), 1)
    database.close()


def _topics(path: Path, reading: Reading) -> list[_Topic]:
    storage = _storage(path, reading)
    try:
        types = _types(storage.connections)
        topics: dict[str, _Topic] = {}
        cells = 0
        for connection, logged, raw in storage.messages(storage.connections):
            topic = topics.setdefault(connection.topic, _Topic(connection.topic))
            if topic.fault:
                continue
            if connection.msgtype not in types.fielddefs:
                topic.fault = f"is of the type {connection.msgtype}, which the file does not define"
                continue
            message = flat(topic.name, types.deserialize_cdr(raw, connection.msgtype))
            if isinstance(message, str):
                topic.fault = message
                continue
            topic.add(logged, message)
            cells += len(message.values)
            reading.holds(len(topic.times), len(message.values))
            reading.holds(1, cells)
        return list(topics.values())
    finally:
        storage.close()


def _types(connections: list[Connection]) -> Typestore:
    """The message types that the file defines, beside those of ROS itself."""
    from rosbags.interfaces import MessageDefinitionFormat as Format
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

    store = get_typestore(Stores.LATEST)
    for connection in connections:
        if connection.msgdef.format == Format.MSG:
            types = get_types_from_msg(connection.msgdef.data, connection.msgtype)
        elif connection.msgdef.format == Format.IDL:
            types = get_types_from_idl(connection.msgdef.data)
        else:
            continue
        store.register(
            {name: fields for name, fields in types.items() if name not in store.fielddefs}
        )
    return store


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
    """The numbers of a message, as `rosbags` makes it, or why it has none that are channels.
    `topic`: its name without the first slash."""
    header = getattr(message, "header", None)
    stamp = getattr(header, "stamp", None)
    ns = None if stamp is None else int(stamp.sec) * SECOND + int(stamp.nanosec)
    fields: list[tuple[str, float]] = []
    if _is_joint_state(message):
        fields = _joints(topic, message)
    elif not _collect(topic, message, fields):
        return f"has more than {MOST_FIELDS} numbers per message"
    if not fields:
        return "holds no numbers"
    return Flat(tuple(name for name, _ in fields), [value for _, value in fields], ns or None)


def _is_joint_state(message: Any) -> bool:
    return all(hasattr(message, name) for name in ("name", "position", "velocity", "effort"))


def _joints(topic: str, message: Any) -> list[tuple[str, float]]:
    """Fields of each joint, by its name and never by its place in the message."""
    reference = _REFERENCE.search(topic) is not None
    names = [str(name) for name in message.name]
    numbers = _joint_numbers(names)
    fields = []
    for field in ("position", "velocity", "effort"):
        values = getattr(message, field)
        for name, number, value in zip(names, numbers, values, strict=len(values) > 0):
            channel = _channel(field, number, reference)
            path = f"{topic}/{name}/{field}"
            fields.append((f"{path}/{channel}" if channel else path, float(value)))
    return sorted(fields)


def _joint_numbers(names: list[str]) -> list[int | None]:
    """The joint (from 1) that each name means by its last number; None where that is not plain."""
    last = [int(digits[-1]) if (digits := _NUMBER.findall(name)) else None for name in names]
    if None in last or len(set(last)) < len(last):
        return [None] * len(names)
    first = 1 if 0 in last else 0  # some count joints from 0
    return [number + first for number in last if number is not None]


def _channel(field: str, joint: int | None, reference: bool) -> str:
    if joint is None:
        return ""
    if field == "position":
        return f"theta{joint}_ref" if reference else f"theta{joint}"
    if field == "velocity":
        return f"dtheta{joint}_ref" if reference else ""
    return "" if reference else f"u{joint}"


def _collect(path: str, value: Any, fields: list[tuple[str, float]]) -> bool:
    """Adds the numbers below `value`; False where there are too many."""
    if isinstance(value, bool | int | float | np.number):
        fields.append((path, float(value)))
    elif isinstance(value, np.ndarray | list | tuple):
        if len(value) > MOST_FIELDS:
            return False
        for k, entry in enumerate(value):
            if not _collect(f"{path}{k + 1}", entry, fields):
                return False
    elif hasattr(value, "__dataclass_fields__"):
        for name in value.__dataclass_fields__:
            if name in ("header", "layout") or name.startswith("__"):
                continue
            here = path if name == "data" else f"{path}/{name}"
            if not _collect(here, getattr(value, name), fields):
                return False
    return len(fields) <= MOST_FIELDS


_CHUNK = 0x06
_SIGNATURE = 8
_RECORD = struct.Struct("<BQ")
_CHUNK_HEAD = struct.Struct("<QQQI")
PIECE = 1_000_000
"""Bytes that are unpacked at once."""


def count_unpacked(path: Path, reading: Reading) -> None:
    """Unpacks each chunk in pieces that are thrown away: a chunk states its size, but what it
    unpacks to may be another one. InputError for more than a recording may have; ValueError where a
    record is longer than the file, or compressed in an unknown way."""
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
        zstd = import_module("compression.zstd" if sys.version_info >= (3, 14) else ZSTD)
        return zstd.ZstdDecompressor()
    raise ValueError(f"the compression {method} is not known")
