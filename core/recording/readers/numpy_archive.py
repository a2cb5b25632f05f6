"""NPZ archives and NPY arrays of NumPy; objects, which only pickle could read, are refused."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import numpy as np

from ...recording.signals import by_length, merged
from ...recording.table import Reading, Table, TableReader, as_vectors

_NPY, _ZIP = b"\x93NUMPY", b"PK\x03\x04"
_END = ".npy"
_NAME = 300
"""Bytes of a zip in which the name of its first member stands."""
LONGEST_HEADER = 10_000
"""Characters; what NumPy itself accepts."""


class NumpyReader(TableReader):
    """One array per channel; rows of a structured array are samples."""

    kind = ".npz .npy"
    file_type = "an archive of NumPy arrays"

    def fits(self, path: Path, start: bytes) -> int:
        return int(
            start.startswith(_NPY) or (start.startswith(_ZIP) and _END.encode() in start[:_NAME])
        )

    def read(self, path: Path, reading: Reading) -> Table:
        columns: dict[str, np.ndarray] = {}
        unusable: dict[str, str] = {}
        for name, file in _members(path):
            _count(name, file, reading)
            values = np.lib.format.read_array(
                file, allow_pickle=False, max_header_size=LONGEST_HEADER
            )
            as_vectors(name, values, columns, unusable)
        return merged(path, by_length("arrays", columns), reading, unusable)


def _members(path: Path) -> Iterator[tuple[str, IO[bytes]]]:
    with path.open("rb") as file:
        if file.read(len(_NPY)) == _NPY:
            file.seek(0)
            yield path.stem, file
            return
    with zipfile.ZipFile(path) as archive:
        names = [name for name in archive.namelist() if name.endswith(_END)]
        for name in names:
            with archive.open(name) as member:
                yield name.removesuffix(_END), member


def _count(name: str, file: IO[bytes], reading: Reading) -> None:
    """Refuse what would unpack to too much, by the header of the array, before it unpacks."""
    version = np.lib.format.read_magic(file)
    read = {
        (1, 0): np.lib.format.read_array_header_1_0,
        (2, 0): np.lib.format.read_array_header_2_0,
    }
    if version not in read:
        raise ValueError(f"version {version} of the array {name} is not known")
    shape, _, kind = read[version](file, max_header_size=LONGEST_HEADER)
    if kind.hasobject:
        raise ValueError(f"the array {name} holds Python objects")
    size = 1
    for length in shape:
        size *= int(length)
    reading.grew(size * kind.itemsize)
    reading.holds(max(shape, default=1), 1)
    file.seek(0)
