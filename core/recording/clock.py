"""Clocks of recordings: their sample times, the gaps in them, and that of the camera."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import InputError
from ..recording.recording import CameraPose
from ..recording.table import Table

MIN_SAMPLES = 10
"""Fewer rows than this cannot distinguish a motion from a mistake in the file."""
JITTER = 0.01
"""Of the sample time: rounding of the time column and a real logger's jitter stay below it."""
DRIFT = 0.5
"""Of the sample time: farther from the even grid, a row belongs to the neighbouring instant."""

RESAMPLE = 'set resample = { how = "interpolate" }'
"""What a person does about an uneven clock, in the scenario."""


def check_rising(table: Table, header: str, time: np.ndarray) -> None:
    """Every row has a `time` (N,) in s, later than the one before; InputError where not."""
    empty = np.flatnonzero(np.isnan(time))
    if empty.size:
        raise InputError(
            f"{table.source}: column {header} is empty in {table.row(empty[0])}; "
            f"every row needs a time."
        )
    falling = np.flatnonzero(np.diff(time) <= 0)
    if falling.size:
        row = int(falling[0]) + 1
        verb = "repeats" if time[row] == time[row - 1] else "decreases to"
        raise InputError(
            f"{table.source}: column {header} {verb} {time[row]:.9g} s in {table.row(row)} after "
            f"{time[row - 1]:.9g} s; {RESAMPLE}, or sort the rows and remove repeated ones."
        )


def choose_rows(
    table: Table, header: str, time: np.ndarray, window: tuple[float, float] | None
) -> slice:
    """The rows whose `time` (N,) in s is inside the window; InputError where they are fewer than
    MIN_SAMPLES."""
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
    """The even grid t0 + k dt (N,) in s that `time` (N,) lies on; an InputError where it does
    not."""
    steps = np.diff(time)
    usual = float(np.median(steps))
    uneven = np.flatnonzero(np.abs(steps - usual) > JITTER * usual)
    if uneven.size:
        k = int(uneven[0])
        raise InputError(
            f"{table.source}: column {header} is not uniform: a step of {steps[k]:.6g} s ends in "
            f"{table.row(first_row + k + 1)}, but {usual:.6g} s is usual; "
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


def runs(empty: np.ndarray) -> list[tuple[int, int]]:
    """(first, stop) of each run of True in a mask `empty` (N,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], empty.astype(np.int8), [0]])))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def bridged(values: np.ndarray, most: int, hold: bool = False) -> np.ndarray:
    """`values` (N,) with straight lines over at most `most` empty rows (NaN) between others, which
    are even in time; what a drive holds from row to row stays as it was before them."""
    empty, short = np.isnan(values), np.zeros(len(values), dtype=bool)
    for first, stop in runs(empty):
        short[first:stop] = stop - first <= most and first > 0 and stop < len(values)
    if not short.any():
        return values
    at = np.arange(len(values))
    before = values[np.maximum.accumulate(np.where(empty, 0, at))]
    return np.where(short, before if hold else np.interp(at, at[~empty], values[~empty]), values)


def longest_complete(empties: Sequence[np.ndarray], N: int) -> slice:
    """The longest stretch of rows, of N, in which none of the masks (N,) is True."""
    complete = ~np.any(np.vstack([np.zeros((1, N), dtype=bool), *empties]), axis=0)
    stretches = runs(complete)
    first, stop = max(stretches, key=lambda pair: pair[1] - pair[0], default=(0, 0))
    return slice(first, stop)


def shifted(x: np.ndarray, shift: float) -> np.ndarray:
    """Samples x (N,) moved earlier by `shift` sample times, not a whole number of them perhaps.

    The whole part moves samples to other rows. For the rest the value at the row's own time is
    interpolated linearly between the sensor's samples around it, so that a slow camera keeps its
    rate. What would come from outside the recording is empty (NaN).
    """
    out = np.full(len(x), np.nan)
    sampled = np.flatnonzero(np.isfinite(x))
    if not sampled.size:
        return out
    rows = sampled - int(np.floor(shift + 0.5))
    # A tolerance: a whole shift of many samples leaves a rest of rounding errors.
    source = np.round(rows + shift, 9)
    inside = (source >= sampled[0]) & (source <= sampled[-1]) & (rows >= 0) & (rows < len(x))
    out[rows[inside]] = np.interp(source[inside], sampled, x[sampled])
    return out


def in_base_frame(
    z1: np.ndarray, z2: np.ndarray, pose: CameraPose
) -> tuple[np.ndarray, np.ndarray]:
    """z = origin + R(angle) scale z_camera in m, from the camera's z1 (N,) and z2 (N,)."""
    c, s = pose.scale * np.cos(pose.angle), pose.scale * np.sin(pose.angle)
    return pose.origin[0] + c * z1 - s * z2, pose.origin[1] + s * z1 + c * z2
