"""MCAP files and bags of ROS 2 (db3): topics, one group each."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from core.errors import InputError
from core.recording.bags import Flat, count_unpacked, flat
from core.recording.reading import Reading
from core.recording.signals import Group, merged
from core.recording.table import Table, TableReader, damaged

if TYPE_CHECKING:
    from rosbags.interfaces import Connection
    from rosbags.typesys.store import Typestore

MCAP, SQLITE = b"\x89MCAP0\r\n", b"SQLite format 3\x00"
NANO = 1e-9


class RosbagReader(TableReader):
    """One file of a bag; the header's stamp of a message is its time, else when it was logged."""

    kind = ".mcap .db3"
    needs = ("rosbags",)

    def fits(self, path: Path, start: bytes) -> int:
        return int(start.startswith((MCAP, SQLITE)))

    def read(self, path: Path, reading: Reading) -> Table:
        reading.grew(path.stat().st_size)
        try:
            topics = _topics(path, reading)
        # The readers raise whatever wrong bytes lead to, SQLite's errors and assertions too.
        except Exception as error:
            if isinstance(error, InputError):
                raise
            raise damaged(path, "a bag of ROS 2", error) from error
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
    found: Any = McapReader(path) if mcap else Sqlite3Reader(path)
    found.open()
    return _Storage(found.connections, found.messages, found.close)


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
    for each in connections:
        if each.msgdef.format == Format.MSG:
            found = get_types_from_msg(each.msgdef.data, each.msgtype)
        elif each.msgdef.format == Format.IDL:
            found = get_types_from_idl(each.msgdef.data)
        else:
            continue
        store.register({name: made for name, made in found.items() if name not in store.fielddefs})
    return store
