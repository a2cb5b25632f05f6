"""Where a model fails: its error by recording along time and frequency, and its worst places.

The error against the motion: does it follow a joint's speed, place, acceleration or bending?
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..diagnose.sensor_noise import noise_of
from ..results import (
    ChannelComparison,
    ErrorMap,
    ErrorMaps,
    ErrorOver,
    JointMotion,
    RecordingComparison,
    WorstCell,
)

WINDOWS = 12
"""Of time, along the longest recording."""

MOST_BANDS = 9
"""Octaves below half the sampling rate; the lowest band reaches down to zero."""

CYCLES = 4.0
"""The lowest band holds at least so many cycles of the longest recording: fewer tell nothing."""

WORST = 10
"""Places that are listed."""

FEWEST = 8
"""Samples in a cell; fewer have no rms worth a colour."""


@dataclass(frozen=True)
class Regular:
    """A channel's error (n,) on its own grid, zero where no sample counts."""

    dt: float
    error: np.ndarray
    counted: int


Cells = tuple[np.ndarray, np.ndarray]
"""rms (n,) and floor (n,) of one recording."""

Parts = list[tuple[RecordingComparison, ChannelComparison]]
"""One channel of all recordings that have it."""


def error_maps(
    comparisons: Sequence[RecordingComparison], floors: Mapping[str, float] | None = None
) -> ErrorMaps:
    """The maps of all channels with a floor; without floors, the noise seen in each error is it."""
    floors = noise_floors(comparisons) if floors is None else floors
    shown = [name for name in _channels(comparisons) if name in floors]
    parts = {name: _parts(comparisons, name) for name in shown}
    by_time = tuple(_time_map(parts[name], floors[name]) for name in shown)
    by_frequency = tuple(_frequency_map(parts[name], floors[name]) for name in shown)
    over = errors_over(comparisons, {name: floors[name] for name in shown})
    return ErrorMaps(by_time, by_frequency, over, worst_cells((*by_time, *by_frequency)))


def noise_floors(comparisons: Sequence[RecordingComparison]) -> dict[str, float]:
    """channel -> rms of the white noise in its error, the median over the recordings."""
    found: dict[str, list[float]] = {}
    for comparison in comparisons:
        for c in comparison.channels:
            noise = noise_of(_regular(c).error)
            if noise > 0.0:
                found.setdefault(c.channel, []).append(noise)
    return {name: float(np.median(values)) for name, values in found.items()}


def worst_cells(maps: Sequence[ErrorMap], count: int = WORST) -> tuple[WorstCell, ...]:
    """The cells furthest above their floor, worst first."""
    cells = [
        WorstCell(
            name, m.channel, m.unit, m.axis, m.axis_unit, float(m.edges[j]),
            float(m.edges[j + 1]), float(m.rms[i, j]), float(m.ratio[i, j]),
        )
        for m in maps
        for i, name in enumerate(m.recordings)
        for j in np.flatnonzero(np.isfinite(m.ratio[i]))
    ]  # fmt: skip
    return tuple(sorted(cells, key=lambda cell: -cell.ratio)[:count])


def _channels(comparisons: Sequence[RecordingComparison]) -> list[str]:
    return list(dict.fromkeys(c.channel for r in comparisons for c in r.channels))


def _parts(comparisons: Sequence[RecordingComparison], channel: str) -> Parts:
    return [(r, c) for r in comparisons for c in r.channels if c.channel == channel]


def _regular(c: ChannelComparison) -> Regular:
    """A camera may give every tenth sample only; its spectrum ends at its own half rate."""
    good = c.counted & np.isfinite(c.residual)
    index = np.flatnonzero(good)
    dt = float(c.time[1] - c.time[0]) if len(c.time) > 1 else 1.0
    if index.size < FEWEST:
        return Regular(dt, np.zeros(0), 0)
    stride = max(int(np.median(np.diff(index))), 1)
    rows = slice(index[0], index[-1] + 1, stride)
    error = np.where(good[rows], c.residual[rows], 0.0)
    return Regular(dt * stride, error, int(good[rows].sum()))


def _map(
    axis: str,
    axis_unit: str,
    parts: Parts,
    edges: np.ndarray,
    cells: Sequence[Cells],
) -> ErrorMap:
    return ErrorMap(
        channel=parts[0][1].channel,
        unit=parts[0][1].unit,
        axis=axis,
        axis_unit=axis_unit,
        recordings=tuple(r.recording for r, _ in parts),
        theta2=tuple(r.theta2 for r, _ in parts),
        edges=edges,
        rms=np.array([rms for rms, _ in cells]),
        floor=np.array([floor for _, floor in cells]),
    )


def _time_map(parts: Parts, floor: float) -> ErrorMap:
    longest = max(float(c.time[-1] - c.time[0]) for _, c in parts)
    edges = np.linspace(0.0, longest, WINDOWS + 1)
    cells = [_in_windows(c, edges, floor) for _, c in parts]
    return _map("time", "s", parts, edges, cells)


def _in_windows(c: ChannelComparison, edges: np.ndarray, floor: float) -> Cells:
    counted = c.counted & np.isfinite(c.residual)
    place = np.searchsorted(edges, c.time[counted] - c.time[0], side="right") - 1
    place = np.clip(place, 0, len(edges) - 2)
    many = np.bincount(place, minlength=len(edges) - 1)
    total = np.bincount(place, c.residual[counted] ** 2, minlength=len(edges) - 1)
    rms = np.sqrt(total / np.maximum(many, 1))
    return np.where(many >= FEWEST, rms, np.nan), np.full(len(edges) - 1, floor)


def _frequency_map(parts: Parts, floor: float) -> ErrorMap:
    grids = [_regular(c) for _, c in parts]
    longest = max(g.dt * len(g.error) for g in grids)
    edges = bands(max(0.5 / g.dt for g in grids), longest)
    cells = [in_bands(g, edges, floor) for g in grids]
    return _map("frequency", "Hz", parts, edges, cells)


def bands(highest: float, seconds: float) -> np.ndarray:
    """Edges (n + 1,) in Hz: octaves down from `highest`, the last one from zero."""
    octaves = np.floor(np.log2(max(highest * seconds / CYCLES, 1.0)))
    halvings = np.arange(min(int(octaves), MOST_BANDS - 1), -1, -1)
    return np.concatenate([[0.0], highest / 2.0**halvings])


def in_bands(seen: Regular, edges: np.ndarray, floor: float) -> Cells:
    """rms (n,) of an error's part in each band, and what white noise of rms `floor` has there.

    A Hann window keeps what is slow out of the fast bands; the squares of the bands add up to
    the squared rms of the error.
    """
    error, n, top = seen.error, len(seen.error), 0.5 / seen.dt
    width = np.clip(np.minimum(edges[1:], top) - edges[:-1], 0.0, None)
    white = floor * np.sqrt(width / top)
    if n < FEWEST:
        return np.full(len(width), np.nan), np.where(width > 0.0, white, np.nan)
    power = np.abs(np.fft.rfft(error * np.hanning(n))) ** 2
    power[1 : (n + 1) // 2] *= 2.0  # both signs of a frequency
    frequency = np.fft.rfftfreq(n, seen.dt)
    place = np.clip(np.searchsorted(edges, frequency, side="left") - 1, 0, len(edges) - 2)
    total = np.bincount(place, power, minlength=len(edges) - 1)
    scale = float(np.sum(error**2)) / seen.counted / max(float(power.sum()), 1e-300)
    there = (np.bincount(place, minlength=len(edges) - 1) > 0) & (width > 0.0)
    return np.where(there, np.sqrt(total * scale), np.nan), np.where(there, white, np.nan)


BINS = 16
"""Of a cloud along each axis."""

FEWEST = 20
"""Samples in a cell; the mean of fewer is noise."""

TAILS = 0.5
"""Per cent on each side that share the outermost bins: a few fast samples stretch no axis."""

QUANTITIES = {
    "position": lambda unit: unit,
    "velocity": lambda unit: f"{unit}/s",
    "acceleration": lambda unit: f"{unit}/s²",
    "deflection": lambda unit: "m",
}
"""What of a joint's motion an error may follow -> its unit, from that of the joint."""


@dataclass(frozen=True)
class _Samples:
    """One channel's counted errors (N,) over all recordings, and how the arm moved then."""

    unit: str
    error: np.ndarray
    motion: JointMotion


def errors_over(
    comparisons: Sequence[RecordingComparison], floors: Mapping[str, float]
) -> tuple[ErrorOver, ...]:
    """Each channel against each quantity of each joint; the clearest pattern first."""
    found = []
    for channel, floor in floors.items():
        samples = _gathered(comparisons, channel)
        if samples is None:
            continue
        for quantity in QUANTITIES:
            for k in range(len(samples.motion.units)):
                one = _over(channel, samples, quantity, k, floor)
                if one is not None:
                    found.append(one)
    return tuple(sorted(found, key=lambda one: -one.explained))


def _gathered(comparisons: Sequence[RecordingComparison], channel: str) -> _Samples | None:
    parts = [
        (c, r.motion)
        for r in comparisons
        for c in r.channels
        if c.channel == channel and r.motion is not None
    ]
    if not parts:
        return None
    counts = [c.counted & np.isfinite(c.residual) for c, _ in parts]

    def joined(name: str) -> np.ndarray:
        rows = [getattr(m, name)[keep] for (_, m), keep in zip(parts, counts, strict=True)]
        return np.concatenate(rows)

    error = np.concatenate([c.residual[keep] for (c, _), keep in zip(parts, counts, strict=True)])
    motion = JointMotion(
        joined("position"), joined("velocity"), joined("acceleration"), joined("deflection"),
        parts[0][1].units,
    )  # fmt: skip
    return _Samples(parts[0][0].unit, error, motion)


def _over(channel: str, samples: _Samples, quantity: str, k: int, floor: float) -> ErrorOver | None:
    x = getattr(samples.motion, quantity)[:, k]
    known = np.isfinite(x)
    x, error = x[known], samples.error[known]
    if x.size < 2 * FEWEST or np.ptp(x) == 0.0:
        return None
    low, high = np.percentile(x, [TAILS, 100.0 - TAILS])
    edges = np.linspace(low, high, BINS + 1) if high > low else np.linspace(x.min(), x.max(), 2)
    backwards = samples.motion.velocity[known, k] < 0.0
    bins = len(edges) - 1
    place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, bins - 1) + bins * backwards
    count = np.bincount(place, minlength=2 * bins)
    mean = np.bincount(place, error, minlength=2 * bins) / np.maximum(count, 1)
    square = np.bincount(place, error**2, minlength=2 * bins) / np.maximum(count, 1)
    few = count < FEWEST
    return ErrorOver(
        channel=channel,
        unit=samples.unit,
        quantity=quantity,
        joint=k + 1,
        quantity_unit=QUANTITIES[quantity](samples.motion.units[k]),
        edges=edges,
        mean=np.where(few, np.nan, mean).reshape(2, bins),
        rms=np.where(few, np.nan, np.sqrt(square)).reshape(2, bins),
        count=count.reshape(2, bins),
        floor=floor,
        explained=_explained(error, place % bins, bins),
    )


def _explained(error: np.ndarray, place: np.ndarray, bins: int) -> float:
    """The correlation ratio: variance between the bins over all variance.

    Both directions together: what depends on the direction alone would otherwise be a pattern
    over every quantity, while over the velocity it is one anyway.
    """
    centred = error - error.mean()
    whole = float(np.sum(centred**2))
    count = np.bincount(place, minlength=bins)
    total = np.bincount(place, centred, minlength=bins)
    between = float(np.sum(total**2 / np.maximum(count, 1)))
    return between / whole if whole > 0.0 else 0.0
