"""Rows that are not even in time put on an even clock, and fast logs on a slower one.

A drive holds its inputs (references, torques, currents, voltages) until the next row: over each
step of the new clock they keep their mean, and with it the motion that they command. What is
measured at every row passes through a cubic spline; a slower sensor's sample goes to the nearest
row. Where rows are missing, cells become empty, and `gaps` says what happens to them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy

from ..errors import InputError
from ..recording.channels import channel_kind
from ..recording.clock import MIN_SAMPLES
from ..recording.decimation import sentence, thinned
from ..recording.recording import Recording
from ..recording.spec import ResampleSpec
from ..recording.table import MOST_CELLS, MOST_ROWS, Table

GAP = 1.75
"""Times a channel's usual step, beyond which a row is missing; jitter hardly reaches that."""
LATE = 1.5
"""Steps by which a stamp may be off where rows are counted, more than its clock is coarse: farther
off, rows are missing."""
BACK = 20.0
"""Steps by which rows may be out of order, as from a network; farther back, a second recording
begins."""
HALF = 0.5
"""Of a step: as near as a grid point may lie to a row to be that row's."""
SAME_RATE = 1e-6
"""Of a rate: as near as a time column written with seven digits states it."""
INPUTS = ("dtheta#_ref", "theta#_ref", "i#_ref", "u#", "i#", "voltage#", "known_torque#")
"""Families of channels that a drive holds from one row to the next."""


class Even(NamedTuple):
    """A table on an even clock."""

    table: Table
    factor: int
    """By which the recording is to be thinned once its gaps are bridged: see `at_rate`."""
    sentence: str
    """What was done, in one line."""


def even_table(
    table: Table,
    headers: Mapping[str, str],
    unit: float,
    spec: ResampleSpec,
    window: tuple[float, float] | None = None,
) -> Even:
    """The table's channels on an even clock; columns without a channel cannot be used any more.
    `headers`: channel -> its column, `t` among them, in `unit` s; rows outside the window (s) are
    left out. InputError where the times have no clock, or the new table would be too large."""
    count = spec.how == "count"
    times = unit * table.numbers(headers["t"])
    rows, dropped = _rows(table, headers["t"], times, window or (-np.inf, np.inf), count)
    time = times[rows]
    values = {c: table.numbers(h)[rows] for c, h in headers.items() if c != "t"}
    dt = _count_step(table, time) if count else _usual_step(values, time)
    stamps = time[0] + dt * np.arange(len(time)) if count else time
    factor = 1
    if spec.rate is not None:
        factor = max(int(np.ceil((1.0 - SAME_RATE) / (dt * spec.rate))), 1)
        dt = 1.0 / (factor * spec.rate)
    grid = _grid(table, _common(values, stamps), dt, len(values))
    columns = {headers["t"]: grid / unit}
    columns |= {headers[c]: _on_grid(c, stamps, v, grid, dt) for c, v in values.items()}
    left = [h for h in (*table.columns, *table.unusable) if h not in columns]
    unusable = dict(table.unusable) | dict.fromkeys(
        left, "is not a channel, so it is not resampled"
    )
    sentence = _sentence(time, grid, dropped, count, factor, dt)
    return Even(
        replace(table, columns=columns, first_line=None, unusable=unusable), factor, sentence
    )


def at_rate(recording: Recording, factor: int) -> Recording:
    """Every factor-th instant behind the low-pass of `core.recording.decimation`; inputs keep their
    mean, samples of a slow sensor go to the nearest instant that is kept."""
    if factor == 1:
        return recording
    inputs = [c for c in recording.channels if channel_kind(c).pattern in INPUTS]
    slow = {c: v for c, v in recording.channels.items() if _is_slow(v, factor)}
    moved = {c: _snapped(v, factor) for c, v in slow.items()}
    return thinned(replace(recording, channels={**recording.channels, **moved}), factor, inputs)


def _is_slow(values: np.ndarray, factor: int) -> bool:
    """Whether it has fewer samples than every factor-th instant could hold twice."""
    return bool(np.isfinite(values).sum() * factor < 2 * len(values))


def _snapped(values: np.ndarray, factor: int) -> np.ndarray:
    """(N,) with each sample in the nearest of the instants that are kept."""
    out = np.full(len(values), np.nan)
    at = np.flatnonzero(np.isfinite(values))
    last = (len(values) - 1) // factor
    rows = factor * np.clip(np.round(at / factor).astype(np.int64), 0, last)
    out[rows] = values[at]
    return out


def _rows(
    table: Table, header: str, time: np.ndarray, window: tuple[float, float], count: bool
) -> tuple[np.ndarray, int]:
    """The rows (K,) that are used, by rising time (by row where rows are counted), and the number
    of rows with an empty or repeated time."""
    inside = ~((time < window[0]) | (time > window[1]))
    good = np.flatnonzero(inside & np.isfinite(time))
    steps = np.diff(time[good])
    rising = steps[steps > 0]
    if len(rising) < MIN_SAMPLES - 1:
        raise InputError(
            f"{table.source}: column {header} has {len(rising) + bool(len(good))} different times, "
            f"at least {MIN_SAMPLES} are needed; check which column is the time."
        )
    back = float(-np.min(steps))
    if back > BACK * float(np.median(rising)):
        raise InputError(
            f"{table.source}: column {header} decreases by {back:.4g} s in "
            f"{table.row(int(good[int(np.argmin(steps)) + 1]))}, as at the start of a second "
            f"recording; store each recording in a file of its own."
        )
    if count:
        return good, int(inside.sum()) - len(good)
    _, first = np.unique(time[good], return_index=True)
    return good[first], int(inside.sum()) - len(first)


def _usual_step(values: Mapping[str, np.ndarray], time: np.ndarray) -> float:
    """s, between the samples of the densest channel."""
    stamps = [time[np.isfinite(v)] for c, v in values.items() if not channel_kind(c).sparse]
    steps = np.diff(max([t for t in stamps if len(t) > 1] or [time], key=len))
    usual = float(np.median(steps))
    # A row after a gap is as many steps on as fit; every other one is one step on, early or late.
    numbers = np.where(steps < GAP * usual, 1.0, np.round(steps / usual))
    return float(steps.sum() / numbers.sum())


def _common(values: Mapping[str, np.ndarray], stamps: np.ndarray) -> tuple[float, float]:
    """s, from where to where all channels that need a number in every row have one; one that ends
    earlier than its own rate explains has a gap instead."""
    low, high = [stamps[0]], [stamps[-1]]
    for channel, x in values.items():
        own = stamps[np.isfinite(x)]
        if channel_kind(channel).sparse or len(own) < MIN_SAMPLES:
            continue
        longest = GAP * float(np.median(np.diff(own)))
        low += [own[0]] if own[0] - stamps[0] <= longest else []
        high += [own[-1]] if stamps[-1] - own[-1] <= longest else []
    return float(max(low)), float(min(high))


def _count_step(table: Table, time: np.ndarray) -> float:
    """s, where every row is one step whatever its stamp says."""
    dt = float(time[-1] - time[0]) / max(len(time) - 1, 1)
    off = np.abs(time - time[0] - dt * np.arange(len(time)))
    worst = int(np.argmax(off))
    coarse = int(np.max(np.diff(np.flatnonzero(np.diff(time, prepend=np.nan, append=np.nan)))))
    if off[worst] > (LATE + coarse) * dt:
        raise InputError(
            f"{table.source}: {table.row(worst)} is {off[worst]:.4g} s off the time that its row "
            f'number gives, so rows are missing; use resample = {{ how = "interpolate" }}.'
        )
    return dt


def _grid(table: Table, ends: tuple[float, float], dt: float, columns: int) -> np.ndarray:
    """s (M,), even, from one end to the other."""
    samples = (ends[1] - ends[0]) / dt + 1.0 + HALF
    most = min(MOST_ROWS, MOST_CELLS // max(columns + 1, 1))
    if samples > most:
        raise InputError(
            f"{table.source}: {ends[0]:.6g} to {ends[1]:.6g} s gives {samples:.3g} samples of "
            f"{dt:.3g} s; at most {most:,} are allowed. Cut it with window, or set a lower "
            f"resample.rate."
        )
    return np.asarray(ends[0] + dt * np.arange(int(samples)))


def _on_grid(
    channel: str, time: np.ndarray, values: np.ndarray, grid: np.ndarray, dt: float
) -> np.ndarray:
    """(M,) of a channel; NaN where it has no sample."""
    good = np.isfinite(values)
    stamps, x, kind = time[good], values[good], channel_kind(channel)
    if len(x) < 4:
        return np.full(len(grid), np.nan)
    if kind.sparse:
        return _nearest(stamps, x, grid, dt)
    out = _held_mean(stamps, x, grid, dt) if kind.pattern in INPUTS else _splined(stamps, x, grid)
    return np.where(_missing(stamps, grid, dt), np.nan, out)


def _missing(stamps: np.ndarray, grid: np.ndarray, dt: float) -> np.ndarray:
    """(M,) where the channel's next rows are farther apart than they usually are."""
    steps = np.diff(stamps)
    at = np.searchsorted(stamps, grid + SAME_RATE * dt, side="right") - 1
    inside = np.clip(at, 0, len(steps) - 1)
    wide = steps[inside] > GAP * max(float(np.median(steps)), dt)
    # A grid point beside a row is that row's, however far the next one is.
    off = np.minimum(np.abs(grid - stamps[inside]), np.abs(stamps[inside + 1] - grid))
    outside = (grid < stamps[0] - HALF * dt) | (grid > stamps[-1] + HALF * dt)
    return np.asarray((wide & (off > HALF * dt)) | outside)


def _held_mean(stamps: np.ndarray, x: np.ndarray, grid: np.ndarray, dt: float) -> np.ndarray:
    """(M,) mean over each step from a grid point on, of x held from row to row.

    Each cumulative sum is taken about the first value: what never changes stays exactly that.
    """
    area = np.concatenate([[0.0], np.cumsum((x[:-1] - x[0]) * np.diff(stamps))])
    edges = np.append(grid, grid[-1] + dt)
    knots = np.append(stamps, stamps[-1] + 2.0 * dt)
    area = np.append(area, area[-1] + (x[-1] - x[0]) * 2.0 * dt)
    mean = x[0] + np.diff(np.interp(edges, knots, area)) / dt
    # A row that is on the grid already, and so is the next one: the very value.
    at = np.clip(np.searchsorted(stamps, grid - SAME_RATE * dt), 0, len(x) - 1)
    close = np.abs(stamps[at] - grid) <= SAME_RATE * dt
    after = np.append(stamps[1:], np.inf)[at] - grid >= (1.0 - SAME_RATE) * dt
    return np.where(close & after, x[at], mean)


def _splined(stamps: np.ndarray, x: np.ndarray, grid: np.ndarray) -> np.ndarray:
    """(M,) of a cubic spline through all rows, not continued beyond them."""
    inside = np.clip(grid, stamps[0], stamps[-1])
    return np.asarray(scipy.interpolate.CubicSpline(stamps, x, bc_type="natural")(inside))


def _nearest(stamps: np.ndarray, x: np.ndarray, grid: np.ndarray, dt: float) -> np.ndarray:
    """(M,) with each sample in the row that is nearest, at most half a step away; each alone."""
    if float(np.median(np.diff(stamps))) < GAP * dt:  # as dense as the encoders: not a slow sensor
        return np.where(_missing(stamps, grid, dt), np.nan, _splined(stamps, x, grid))
    out = np.full(len(grid), np.nan)
    rows = np.round((stamps - grid[0]) / dt).astype(np.int64)
    inside = (rows >= 0) & (rows < len(grid))
    out[rows[inside]] = x[inside]
    return out


def _sentence(
    time: np.ndarray, grid: np.ndarray, dropped: int, count: bool, factor: int, dt: float
) -> str:
    """The method in one line."""
    steps, rate = np.diff(time), 1.0 / (factor * dt)
    span = f"steps of {1e3 * steps.min():.4g} to {1e3 * steps.max():.4g} ms"
    if count:
        method = f"{len(time)} rows ({span}) taken as evenly spaced, timestamps ignored"
    else:
        method = (
            f"{len(time)} rows ({span}): encoders by a cubic spline, inputs held and averaged "
            f"over each step, slow sensors in the nearest row"
        )
    parts = [f"Resampled to {-(-len(grid) // factor)} samples at {rate:.6g} Hz from {method}"]
    parts += [f"{dropped} rows with an empty or repeated timestamp left out"] if dropped else []
    parts += [f"thinned behind {sentence(factor, dt)}"] if factor > 1 else []
    return "; ".join(parts) + "."
