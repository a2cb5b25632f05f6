"""MAT files (up to version 7.2): vectors, or one struct of vectors.

Not by SciPy, whose reader ends the whole process with a segmentation fault at some damaged bytes.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...errors import InputError
from ...recording.table import Reading, Table, TableReader

HEADER = 128
PIECE = 2**20
"""Bytes that are unpacked at once, and then counted."""
MATRIX, COMPRESSED = 14, 15
NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8"} | {
    12: "i8",
    13: "u8",
}
"""How an element's numbers are stored, by the element's type."""
LETTERS = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
STRUCT_CLASS, CHAR_CLASS, NUMBER_CLASSES = 2, 4, range(6, 16)
COMPLEX = 0x08

Bytes = bytes | memoryview
Variable = np.ndarray | str | dict[str, "Variable"] | None
"""Numbers (squeezed), a text, a struct, or None for what a table cannot use."""


class _Element(NamedTuple):
    kind: int
    data: Bytes


def _variables(content: bytes, reading: Reading) -> Iterator[tuple[str, Variable]]:
    order = {b"IM": "<", b"MI": ">"}[content[126:128]]
    for element in _elements(memoryview(content)[HEADER:], order):
        inner = element
        if element.kind == COMPRESSED:
            inner = _next(_elements(_unpacked(element.data, order, reading), order))
        if inner.kind == MATRIX:
            yield _matrix(inner.data, order, depth=0)


def _unpacked(packed: Bytes, order: str, reading: Reading) -> bytes:
    """An array that is too large is refused by its header, before its memory is allocated."""
    unpacker, unpacked, remaining, counted = zlib.decompressobj(), bytearray(), packed, 0
    while not unpacker.eof:
        piece = unpacker.decompress(remaining, PIECE)
        remaining = unpacker.unconsumed_tail
        if not piece and not remaining and not unpacker.eof:
            raise ValueError("a variable is cut short")
        unpacked += piece
        stated = 8 + struct.unpack_from(order + "I", unpacked, 4)[0] if len(unpacked) >= 8 else 0
        size = max(len(unpacked), stated)
        reading.grew(size - counted)
        counted = size
    return bytes(unpacked)


def _elements(content: Bytes, order: str) -> Iterator[_Element]:
    position = 0
    while position < len(content):
        (tag,) = struct.unpack_from(order + "I", content, position)
        if tag >> 16:  # the short form: length, type and up to four bytes in eight
            kind, length, start, step = tag & 0xFFFF, tag >> 16, position + 4, 8
        else:
            kind, start = tag, position + 8
            (length,) = struct.unpack_from(order + "I", content, position + 4)
            padding = 0 if kind == COMPRESSED else -length % 8
            step = 8 + length + padding
        if start + length > len(content):
            raise ValueError("a variable is cut short")
        yield _Element(kind, content[start : start + length])
        position += step


def _matrix(data: Bytes, order: str, depth: int) -> tuple[str, Variable]:
    if not data:
        return "", None
    parts = _elements(data, order)
    flags = int(_numbers(_next(parts), order)[0])
    shape = tuple(int(n) for n in _numbers(_next(parts), order))
    name = bytes(_next(parts).data).decode("latin-1").rstrip("\0")
    kind = flags & 0xFF
    if kind in NUMBER_CLASSES and not (flags >> 8) & COMPLEX:
        return name, _numbers(_next(parts), order).reshape(shape, order="F").squeeze()
    if kind == CHAR_CLASS:
        return name, _text(_next(parts), order)
    if kind == STRUCT_CLASS and shape == (1, 1) and depth < 2:
        return name, _struct(parts, order, depth)
    return name, None


def _struct(parts: Iterator[_Element], order: str, depth: int) -> dict[str, Variable]:
    width = int(_numbers(_next(parts), order)[0])
    if width < 1:
        raise ValueError("a struct has no names")
    raw = bytes(_next(parts).data)
    names = [
        raw[k : k + width].split(b"\0")[0].decode("latin-1") for k in range(0, len(raw), width)
    ]
    return {name: _matrix(_next(parts).data, order, depth + 1)[1] for name in names}


def _next(parts: Iterator[_Element]) -> _Element:
    part = next(parts, None)
    if part is None:
        raise ValueError("a variable is cut short")
    return part


def _numbers(element: _Element, order: str) -> np.ndarray:
    return np.frombuffer(element.data, dtype=order + NUMBERS[element.kind])


def _text(element: _Element, order: str) -> str:
    encoding = LETTERS[element.kind]
    if encoding.startswith("utf-") and encoding != "utf-8":
        encoding += "-le" if order == "<" else "-be"
    return bytes(element.data).decode(encoding)


UNITS = "units"
"""A struct of this name may give units, since a MATLAB name cannot: units.theta1 = 'deg'."""
_VERSIONS = (b"\x00\x01IM", b"\x01\x00MI")
"""Version 1.0 (of files 5 to 7.2) in both orders of bytes."""


class MatlabReader(TableReader):
    """Every vector is a column; an optional struct `units` gives their units."""

    kind = ".mat"
    file_type = "a MAT file of version 5 to 7.2"

    def fits(self, path: Path, start: bytes) -> int:
        return int(start.startswith(b"MATLAB 5") or start[124:128] in _VERSIONS)

    def read(self, path: Path, reading: Reading) -> Table:
        reading.grew(path.stat().st_size)
        variables: dict[str, Any] = dict(_variables(path.read_bytes(), reading))
        units = variables.pop(UNITS, {})
        if len(variables) == 1 and isinstance(only := next(iter(variables.values())), dict):
            variables = {**only}
            units = variables.pop(UNITS, units)
        columns: dict[str, np.ndarray] = {}
        unusable: dict[str, str] = {}
        rows = max((np.size(v) for v in variables.values() if np.ndim(v) == 1), default=0)
        if rows == 0:
            raise InputError(f"{path.name} holds no vectors; save t, theta1, ... as vectors in it.")
        reading.holds(rows, sum(np.ndim(v) == 1 for v in variables.values()))
        for name, value in variables.items():
            fault = _fault(value, rows)
            header = _header(name, units)
            if fault:
                unusable[header] = fault
            else:
                columns[header] = value.astype(float)
        return Table(path.name, columns, unusable=unusable)


def _header(name: str, units: Any) -> str:
    unit = units.get(name) if isinstance(units, dict) else None
    return f"{name} [{unit}]" if isinstance(unit, str) and unit else name


def _fault(value: Any, rows: int) -> str:
    if not isinstance(value, np.ndarray):
        return "is not an array of real numbers"
    if value.ndim != 1:
        return f"is not a vector but has {value.ndim} dimensions"
    if value.size != rows:
        return f"has {value.size} values where the longest vector has {rows}"
    return ""
