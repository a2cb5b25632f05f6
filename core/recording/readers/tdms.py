"""TDMS files, as LabVIEW writes them."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from core.errors import InputError
from core.recording.signals import Group, by_length, merged
from core.recording.table import Reading, Table, TableReader, as_vectors, damaged

if TYPE_CHECKING:
    from nptdms import TdmsChannel, TdmsFile


class TdmsReader(TableReader):
    """One column per channel; a time channel or the waveform's increment is the clock."""

    kind = ".tdms"
    needs = ("nptdms",)

    def fits(self, path: Path, start: bytes) -> int:
        return int(start.startswith(b"TDSm"))

    def read(self, path: Path, reading: Reading) -> Table:
        from nptdms import TdmsFile

        try:
            with _quiet(), TdmsFile.open(path) as file:
                unusable: dict[str, str] = {}
                groups = _groups(file, reading, unusable)
        # Its reader raises whatever the wrong bytes lead to, struct.error and IndexError too.
        except Exception as error:
            if isinstance(error, InputError):
                raise
            raise damaged(path, "a TDMS file", error) from error
        return merged(path, groups, reading, unusable)


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """It logs what it meets in a damaged file, where one sentence is expected."""
    logs = [logging.getLogger(name) for name in list(logging.root.manager.loggerDict)]
    ours = [(log, log.disabled) for log in logs if log.name.startswith("nptdms")]
    for log, _ in ours:
        log.disabled = True
    try:
        yield
    finally:
        for log, before in ours:
            log.disabled = before


def _groups(file: TdmsFile, reading: Reading, unusable: dict[str, str]) -> list[Group]:
    groups: list[Group] = []
    for group in file.groups():
        columns: dict[str, np.ndarray] = {}
        times: dict[int, np.ndarray] = {}
        for channel in group.channels():
            reading.holds(len(channel), len(group.channels()))
            reading.grew(8 * len(channel))
            if channel.dtype.kind not in "iuf":
                unusable[_header(group.name, channel)] = "is no array of real numbers"
                continue
            values = np.asarray(channel[:])
            unit = str(channel.properties.get("unit_string", ""))
            as_vectors(f"{group.name}/{channel.name}", values, columns, unusable, unit)
            step = channel.properties.get("wf_increment")
            if isinstance(step, float) and step > 0:
                start = float(channel.properties.get("wf_start_offset", 0.0))
                times[len(values)] = start + step * np.arange(len(values))
        for made in by_length(group.name, columns):
            if made.time is None:
                made.time = times.get(made.rows)
            groups.append(made)
    return groups


def _header(group: str, channel: TdmsChannel) -> str:
    return f"{group}/{channel.name}"
