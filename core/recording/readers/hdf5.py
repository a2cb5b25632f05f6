"""HDF5 files, and MAT files of version 7.3, which are HDF5 inside."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...recording.signals import Group, by_length, merged
from ...recording.table import Reading, Table, TableReader, as_vectors

if TYPE_CHECKING:
    from h5py import Dataset, File

SIGNATURE = b"\x89HDF\r\n\x1a\n"
SIGNATURE_PLACES = (0, 512, 1024, 2048)
"""Where the signature may stand; MAT 7.3 has 512 bytes of its own before it."""
UNITS = "units"
"""A struct (group) of this name may give units: units.theta1 = 'deg'."""
MOST_OBJECTS = 10_000
"""Groups and data sets of one file; the fullest logs have some hundreds."""
_HIDDEN = "#"
"""MATLAB keeps what cells refer to under such names."""


class Hdf5Reader(TableReader):
    """One data set per channel, in any group; an attribute `units` gives its unit."""

    kind = ".h5 .hdf5 .hdf"
    file_type = "an HDF5 file"
    needs = ("h5py",)

    def fits(self, path: Path, start: bytes) -> int:
        return int(any(start[k : k + len(SIGNATURE)] == SIGNATURE for k in SIGNATURE_PLACES))

    def read(self, path: Path, reading: Reading) -> Table:
        import h5py

        with h5py.File(path, "r") as file:
            groups, unusable = _groups(file, reading)
        return merged(path, groups, reading, unusable)


def _groups(file: File, reading: Reading) -> tuple[list[Group], dict[str, str]]:
    places = _data_sets(file)
    units = _stated_units(places)
    groups: list[Group] = []
    unusable: dict[str, str] = {}
    for place, sets in places.items():
        columns: dict[str, np.ndarray] = {}
        for name, data_set in sets.items():
            path = f"{place}/{name}" if place else name
            text = data_set.dtype.kind in "SOUV" and not data_set.dtype.names
            if text or place.split("/")[-1] == UNITS:
                continue
            reading.grew(int(np.prod(data_set.shape, dtype=float)) * data_set.dtype.itemsize)
            reading.holds(max(data_set.shape, default=0), 1)
            as_vectors(
                path, np.asarray(data_set[()]), columns, unusable, _unit(data_set, name, units)
            )
        groups += by_length(place or "/", columns)
    return groups, unusable


def _data_sets(file: File) -> dict[str, dict[str, Dataset]]:
    """Group's path -> name -> data set; links, which may lead to other files, are not visited."""
    import h5py

    places: dict[str, dict[str, Dataset]] = {}
    paths: set[str] = set()

    def note(path: str, item: Any) -> None:
        paths.add(path)
        if len(paths) > MOST_OBJECTS:
            raise ValueError(f"it has more than {MOST_OBJECTS:,} groups and data sets")
        place, _, name = path.rpartition("/")
        if not isinstance(item, h5py.Dataset) or f"/{_HIDDEN}" in f"/{path}":
            return
        # No external storage: a file must not name others of this machine.
        if item.external is None and not item.is_virtual and item.shape is not None:
            places.setdefault(place, {})[name] = item

    file.visititems(note)
    return places


def _stated_units(places: dict[str, dict[str, Dataset]]) -> dict[str, str]:
    return {
        name: _text(data_set[()])
        for place, sets in places.items()
        if place.split("/")[-1] == UNITS
        for name, data_set in sets.items()
        if data_set.size and data_set.size < 100
    }


def _unit(data_set: Dataset, name: str, units: dict[str, str]) -> str:
    for key in ("units", "unit", "Units", "Unit"):
        if key in data_set.attrs:
            return _text(data_set.attrs[key])
    return units.get(name, "")


def _text(value: Any) -> str:
    """A text as h5py or MATLAB (numbers of characters) stores it."""
    if isinstance(value, np.ndarray) and value.dtype.kind in "iu":
        return "".join(chr(int(x)) for x in value.ravel() if 0 < x < 0x10000)
    if isinstance(value, np.ndarray):
        value = value.ravel()[0] if value.size else ""
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
