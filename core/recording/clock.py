"""The time column: rising, even, and then exactly even."""

from __future__ import annotations

import numpy as np

from core.errors import InputError
from core.recording.table import Table

MIN_SAMPLES = 10
"""Fewer rows than this cannot tell a motion from a mistake in the file."""
JITTER = 0.01
"""Of the sample time: rounding of the time column and a real logger's jitter stay below it."""
DRIFT = 0.5
"""Of the sample time: farther from the even grid, a row belongs to the neighbouring instant."""

RESAMPLE = 'set resample = { how = "interpolate" }'
"""What a person does about an uneven clock, in the scenario."""


def check_rising(table: Table, header: str, time: np.ndarray) -> None:
    """Every row has a time, later than the one before."""
    empty = np.flatnonzero(np.isnan(time))
    if empty.size:
        raise InputError(
            f"{table.source}: column {header} is empty in {table.row(empty[0])}; "
            f"every row needs a time."
        )
    falling = np.flatnonzero(np.diff(time) <= 0)
    if falling.size:
        row = int(falling[0]) + 1
        verb = "repeats" if time[row] == time[row - 1] else "falls back to"
        raise InputError(
            f"{table.source}: column {header} {verb} {time[row]:.9g} s in {table.row(row)} after "
            f"{time[row - 1]:.9g} s; {RESAMPLE}, or sort the rows and remove doubled ones."
        )


def choose_rows(
    table: Table, header: str, time: np.ndarray, window: tuple[float, float] | None
) -> slice:
    """The rows inside the window; at least MIN_SAMPLES of them."""
    low, high = window or (-np.inf, np.inf)
    first, last = int(np.searchsorted(time, low)), int(np.searchsorted(time, high, side="right"))
    if last - first < MIN_SAMPLES:
        where = f" in the window [{low:g}, {high:g}] s" if window else ""
        span = f"column {header} runs from {time[0]:g} to {time[-1]:g} s"
        raise InputError(
            f"{table.source} has {last - first} samples{where}, at least {MIN_SAMPLES} are needed; "
            f"{span}."
        )
    return slice(first, last)


def even_time(table: Table, header: str, time: np.ndarray, first_row: int) -> np.ndarray:
    """The even grid t0 + k dt (N,) that the times lie on; an InputError where they do not."""
    steps = np.diff(time)
    usual = float(np.median(steps))
    uneven = np.flatnonzero(np.abs(steps - usual) > JITTER * usual)
    if uneven.size:
        k = int(uneven[0])
        raise InputError(
            f"{table.source}: column {header} is not uniform: it steps by {steps[k]:.6g} s into "
            f"{table.row(first_row + k + 1)} where {usual:.6g} s is usual; "
            f"{RESAMPLE}, or cut it with window."
        )
    n = len(time)
    grid = time[0] + (time[-1] - time[0]) / (n - 1) * np.arange(n)
    off = np.abs(time - grid)
    worst = int(np.argmax(off))
    if off[worst] > DRIFT * usual:
        raise InputError(
            f"{table.source}: column {header} is not uniform: {table.row(first_row + worst)} is "
            f"{off[worst]:.3g} s off an even grid; {RESAMPLE}, or cut it with window."
        )
    return np.asarray(grid)
