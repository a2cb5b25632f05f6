"""MAT files (up to version 7.2): vectors, or one struct of vectors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from core.errors import InputError
from core.recording.mat5 import DamagedError, variables
from core.recording.reading import Reading
from core.recording.table import Table, TableReader, damaged

UNITS = "units"
"""A struct of this name may give units, since a MATLAB name cannot: units.theta1 = 'deg'."""
_VERSIONS = (b"\x00\x01IM", b"\x01\x00MI")
"""Version 1.0 (of files 5 to 7.2) in both orders of bytes."""


class MatlabReader(TableReader):
    """Every vector is a column; an optional struct `units` gives their units."""

    kind = ".mat"

    def fits(self, path: Path, start: bytes) -> int:
        return int(start.startswith(b"MATLAB 5") or start[124:128] in _VERSIONS)

    def read(self, path: Path, reading: Reading) -> Table:
        found = _variables(path, reading)
        units = found.pop(UNITS, {})
        columns: dict[str, np.ndarray] = {}
        unusable: dict[str, str] = {}
        rows = max((np.size(v) for v in found.values() if np.ndim(v) == 1), default=0)
        if rows == 0:
            raise InputError(f"{path.name} holds no vectors; save t, theta1, ... as vectors in it.")
        reading.holds(rows, sum(np.ndim(v) == 1 for v in found.values()))
        for name, value in found.items():
            fault = _fault(value, rows)
            header = _header(name, units)
            if fault:
                unusable[header] = fault
            else:
                columns[header] = value.astype(float)
        return Table(path.name, columns, unusable=unusable)


def _variables(path: Path, reading: Reading) -> dict[str, Any]:
    reading.grew(path.stat().st_size)
    content = path.read_bytes()
    if not content:
        raise InputError(f"{path.name} is empty; save t, theta1, ... as vectors in it.")
    try:
        found: dict[str, Any] = variables(content, reading.grew)
    except DamagedError as error:
        raise damaged(path, "a MAT file of version 5 to 7.2", error) from error
    others = [name for name in found if name != UNITS]
    if len(others) == 1 and isinstance(found[others[0]], dict):
        return {UNITS: found.get(UNITS, {}), **found[others[0]]}
    return found


def _header(name: str, units: Any) -> str:
    unit = units.get(name) if isinstance(units, dict) else None
    return f"{name} [{unit}]" if isinstance(unit, str) and unit else name


def _fault(value: Any, rows: int) -> str:
    if not isinstance(value, np.ndarray):
        return "is no array of real numbers"
    if value.ndim != 1:
        return f"is no vector but has {value.ndim} dimensions"
    if value.size != rows:
        return f"has {value.size} values where the longest vector has {rows}"
    return ""
