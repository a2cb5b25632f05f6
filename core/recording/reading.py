"""The contract of a reader of files, and arrays cut into one column per channel."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import numpy as np

from core.errors import InputError

MOST_BYTES = 400_000_000
"""Unpacked: the text of MOST_CELLS numbers with all their digits."""
MOST_CELLS = 20_000_000
"""Half an hour of ten channels at 1 kHz: 160 MB, of which a fit keeps several copies."""
MOST_ROWS = 5_000_000
"""Samples of one recording: an hour at 1.4 kHz."""
MEGA = 1e6


class Watching(Protocol):
    """What it needs of whoever waits: see `core.progress.Progress`."""

    def advance(self, n: int = 1, text: str = "") -> None:
        """`n` steps are done; `text` says of what."""

    def stopped(self) -> bool:
        """Whether reading should end."""


class Reading:
    """Counts while a file is read and says how far it is; `took` and `grew` raise InputError."""

    def __init__(self, path: Path, progress: Watching | None = None) -> None:
        self.name = path.name
        self._size = max(path.stat().st_size, 1)
        self._progress = progress
        self._unpacked = 0
        self.took(0)

    def took(self, position: int) -> None:
        """The file is read up to `position` bytes; InputError where nobody waits for the rest."""
        if self._progress is None:
            return
        if self._progress.stopped():
            raise InputError(f"Stopped while {self.name} was read.")
        share = min(position / self._size, 1.0)
        self._progress.advance(0, f"{self.name}, {share:.0%} read")

    def grew(self, size: int) -> None:
        """Another `size` bytes are unpacked."""
        self._unpacked += size
        if self._unpacked > MOST_BYTES:
            raise InputError(
                f"{self.name} unpacks to more than {MOST_BYTES / MEGA:.0f} MB; cut the recording "
                f"or keep fewer columns."
            )

    def holds(self, rows: int, columns: int) -> None:
        """So many rows and columns are known to be in it."""
        if rows > MOST_ROWS:
            raise InputError(
                f"{self.name} has more than {MOST_ROWS:,} samples; cut it into shorter recordings."
            )
        if rows * columns > MOST_CELLS:
            raise InputError(
                f"{self.name} has more than {MOST_CELLS:,} numbers; cut the recording or keep "
                f"fewer columns."
            )


WIDEST = 64
"""Columns of one array that are channels; a wider one is a picture."""


def as_vectors(
    name: str,
    values: np.ndarray,
    columns: dict[str, np.ndarray],
    unusable: dict[str, str],
    unit: str = "",
) -> None:
    """Adds the columns of an array, and what is wrong where it has none.

    An array theta (N, 2), or (2, N), gives theta1 and theta2; a structured one its fields.

    Args:
        name: Path in the file.
        values: Any array.
        columns: Header -> (N,); added to.
        unusable: Header -> what is wrong; added to.
        unit: Of the values; empty where the file says none.
    """
    header = f"{name} [{unit}]" if unit else name
    if values.dtype.names:
        for part in values.dtype.names:
            as_vectors(f"{name}/{part}", values[part], columns, unusable)
        return
    if values.dtype.kind not in "iuf":
        unusable[header] = "is no array of real numbers"
        return
    values = np.squeeze(values)
    if values.ndim == 0:
        unusable[header] = "is one number and no vector"
    elif values.ndim == 1:
        columns[header] = values.astype(float) if values.dtype.kind == "f" else values
    elif values.ndim == 2 and min(values.shape) <= WIDEST:
        rows = values if values.shape[0] >= values.shape[1] else values.T
        for k in range(rows.shape[1]):
            end = f"{name}{k + 1}"
            columns[f"{end} [{unit}]" if unit else end] = rows[:, k].astype(float)
    else:
        unusable[header] = f"is no vector but has {values.ndim} dimensions"
