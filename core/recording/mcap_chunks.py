"""How much the compressed chunks of an MCAP file unpack to, counted before anything trusts it."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import IO, Any

from core.recording.reading import Reading

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
