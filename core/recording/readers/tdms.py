"""TDMS files, as LabVIEW writes them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...recording.signals import Group, by_length, merged
from ...recording.table import Reading, Table, TableReader, as_vectors, quiet

if TYPE_CHECKING:
    from nptdms import TdmsFile


class TdmsReader(TableReader):
    """One column per channel; a time channel or the waveform's increment is the clock."""

    kind = ".tdms"
    file_type = "a TDMS file"
    needs = ("nptdms",)

    def fits(self, path: Path, start: bytes) -> int:
        return int(start.startswith(b"TDSm"))

    def read(self, path: Path, reading: Reading) -> Table:
        from nptdms import TdmsFile

        unusable: dict[str, str] = {}
        with quiet("nptdms"), TdmsFile.open(path) as file:
            groups = _groups(file, reading, unusable)
        return merged(path, groups, reading, unusable)


def _groups(file: TdmsFile, reading: Reading, unusable: dict[str, str]) -> list[Group]:
    groups: list[Group] = []
    for group in file.groups():
        columns: dict[str, np.ndarray] = {}
        times: dict[int, np.ndarray] = {}
        for channel in group.channels():
            reading.holds(len(channel), len(group.channels()))
            reading.grew(8 * len(channel))
            name = f"{group.name}/{channel.name}"
            if channel.dtype.kind not in "iuf":
                unusable[name] = "is not an array of real numbers"
                continue
            values = np.asarray(channel[:])
            unit = str(channel.properties.get("unit_string", ""))
            as_vectors(name, values, columns, unusable, unit)
            step = channel.properties.get("wf_increment")
            if isinstance(step, float) and step > 0:
                start = float(channel.properties.get("wf_start_offset", 0.0))
                times[len(values)] = start + step * np.arange(len(values))
        for item in by_length(group.name, columns):
            if item.time is None:
                item.time = times.get(item.rows)
            groups.append(item)
    return groups
