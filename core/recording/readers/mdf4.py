"""MDF files of version 4 (and 3), as test benches of the car industry write them."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...recording.signals import Group, merged
from ...recording.table import Reading, Table, TableReader, as_vectors, quiet

if TYPE_CHECKING:
    from asammdf import MDF


class Mdf4Reader(TableReader):
    """One group per clock; the unit of each channel is the file's."""

    kind = ".mf4 .mdf"
    file_type = "an MDF file"
    needs = ("asammdf",)

    def fits(self, path: Path, start: bytes) -> int:
        return int(start.startswith((b"MDF     ", b"UnFinMF ")))

    def read(self, path: Path, reading: Reading) -> Table:
        unusable: dict[str, str] = {}
        with quiet("asammdf"):
            groups, error = _read(path, reading, unusable)
            if error is not None:
                gc.collect()  # a half-opened file complains while it is taken away
        if error is not None:
            raise error
        return merged(path, groups, reading, unusable)


def _read(
    path: Path, reading: Reading, unusable: dict[str, str]
) -> tuple[list[Group], Exception | None]:
    from asammdf import MDF

    try:
        with path.open("rb") as raw, MDF(raw) as file:
            return list(_groups(file, reading, unusable)), None
    # Its reader raises whatever the wrong bytes lead to.
    except Exception as error:
        error.__context__ = None
        return [], error.with_traceback(None)


def _groups(file: MDF, reading: Reading, unusable: dict[str, str]) -> Iterator[Group]:
    stored: Any = file.groups
    for index, group in enumerate(stored):
        rows = int(group.channel_group.cycles_nr)
        reading.holds(rows, len(group.channels))
        reading.grew(8 * rows * len(group.channels))
        columns: dict[str, np.ndarray] = {}
        time = np.asarray(file.get_master(index), dtype=float)
        master = file.masters_db.get(index)
        name = str(group.channel_group.acq_name or f"group {index + 1}")
        for k, channel in enumerate(group.channels):
            if k == master:
                continue
            signal = file.get(group=index, index=k)
            label = f"{name}/{channel.name}"
            as_vectors(label, np.asarray(signal.samples), columns, unusable, str(signal.unit or ""))
        yield Group(name, columns, time)
