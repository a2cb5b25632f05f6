"""Error maps: error by recording over time and frequency, worst places, and error over the
motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .noise.sensor_noise import noise_of
from .results import (
    ChannelComparison,
    ErrorMap,
    ErrorMaps,
    ErrorOver,
    JointMotion,
    RecordingComparison,
    WorstCell,
)

WINDOWS = 12
"""Time windows, along the longest recording."""

MOST_BANDS = 9
"""Octaves below half the sampling rate; the lowest band reaches down to zero."""

CYCLES = 4.0
"""Least cycles of the longest recording in the lowest band."""

WORST = 10
"""Worst places that are listed."""

FEWEST_FOR_RMS = 8
"""Samples in a cell; fewer give no rms."""


@dataclass(frozen=True)
class EvenlySampled:
    """A channel's error (n,) on its own grid, zero where no sample counts."""

    dt: float
    error: np.ndarray
    counted: int


Cells = tuple[np.ndarray, np.ndarray]
"""rms (n,) and noise floor (n,) of one recording."""

Parts = list[tuple[RecordingComparison, ChannelComparison]]
"""One channel of all recordings that have it."""


def error_maps(
    comparisons: Sequence[RecordingComparison], floors: Mapping[str, float] | None = None
) -> ErrorMaps:
    """The maps of all channels with a noise floor; without floors, the noise seen in each error."""
    floors = noise_floors(comparisons) if floors is None else floors
    shown = [name for name in _channels(comparisons) if name in floors]
    parts = {name: _channel_parts(comparisons, name) for name in shown}
    by_time = tuple(_time_map(parts[name], floors[name]) for name in shown)
    by_frequency = tuple(_frequency_map(parts[name], floors[name]) for name in shown)
    over = errors_over(comparisons, {name: floors[name] for name in shown})
    return ErrorMaps(by_time, by_frequency, over, worst_cells((*by_time, *by_frequency)))


def noise_floors(comparisons: Sequence[RecordingComparison]) -> dict[str, float]:
    """channel -> rms of the white noise in its error, the median over the recordings."""
    levels: dict[str, list[float]] = {}
    for comparison in comparisons:
        for c in comparison.channels:
            noise = noise_of(_evenly_sampled(c).error)
            if noise > 0.0:
                levels.setdefault(c.channel, []).append(noise)
    return {name: float(np.median(values)) for name, values in levels.items()}


def worst_cells(maps: Sequence[ErrorMap], count: int = WORST) -> tuple[WorstCell, ...]:
    """The cells furthest above their noise floor, worst first."""
    cells = [
        m.cell(i, int(j))
        for m in maps
        for i in range(len(m.recordings))
        for j in np.flatnonzero(np.isfinite(m.ratio[i]))
    ]
    return tuple(sorted(cells, key=lambda cell: -cell.ratio)[:count])


def _channels(comparisons: Sequence[RecordingComparison]) -> list[str]:
    return list(dict.fromkeys(c.channel for r in comparisons for c in r.channels))


def _channel_parts(comparisons: Sequence[RecordingComparison], channel: str) -> Parts:
    return [(r, c) for r in comparisons for c in r.channels if c.channel == channel]


def _evenly_sampled(c: ChannelComparison) -> EvenlySampled:
    """The channel's error at its own rate: a camera may give only every tenth sample."""
    good = c.counted & np.isfinite(c.residual)
    index = np.flatnonzero(good)
    dt = float(c.time[1] - c.time[0]) if len(c.time) > 1 else 1.0
    if index.size < FEWEST_FOR_RMS:
        return EvenlySampled(dt, np.zeros(0), 0)
    stride = max(int(np.median(np.diff(index))), 1)
    rows = slice(index[0], index[-1] + 1, stride)
    error = np.where(good[rows], c.residual[rows], 0.0)
    return EvenlySampled(dt * stride, error, int(good[rows].sum()))


def _map(
    axis: str, axis_unit: str, parts: Parts, edges: np.ndarray, cells: Sequence[Cells]
) -> ErrorMap:
    return ErrorMap(
        channel=parts[0][1].channel, unit=parts[0][1].unit, axis=axis, axis_unit=axis_unit,
        recordings=tuple(r.recording for r, _ in parts), theta2=tuple(r.theta2 for r, _ in parts),
        edges=edges, rms=np.array([rms for rms, _ in cells]),
        floor=np.array([floor for _, floor in cells]),
    )  # fmt: skip


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
    return np.where(many >= FEWEST_FOR_RMS, rms, np.nan), np.full(len(edges) - 1, floor)


def _frequency_map(parts: Parts, floor: float) -> ErrorMap:
    grids = [_evenly_sampled(c) for _, c in parts]
    longest = max(g.dt * len(g.error) for g in grids)
    edges = bands(max(0.5 / g.dt for g in grids), longest)
    cells = [in_bands(g, edges, floor) for g in grids]
    return _map("frequency", "Hz", parts, edges, cells)


def bands(highest: float, seconds: float) -> np.ndarray:
    """Edges (n + 1,) in Hz: octaves down from `highest`, as far as `seconds` show them, the last
    one from zero."""
    octaves = np.floor(np.log2(max(highest * seconds / CYCLES, 1.0)))
    halvings = np.arange(min(int(octaves), MOST_BANDS - 1), -1, -1)
    return np.concatenate([[0.0], highest / 2.0**halvings])


def in_bands(samples: EvenlySampled, edges: np.ndarray, floor: float) -> Cells:
    """rms (n,) of an error in each band between edges (n + 1,) in Hz, and that of white noise of
    rms `floor`.

    A Hann window keeps slow parts out of fast bands; the bands' squares add up to the error's.
    """
    error, n, top = samples.error, len(samples.error), 0.5 / samples.dt
    width = np.clip(np.minimum(edges[1:], top) - edges[:-1], 0.0, None)
    white = floor * np.sqrt(width / top)
    if n < FEWEST_FOR_RMS:
        return np.full(len(width), np.nan), np.where(width > 0.0, white, np.nan)
    power = np.abs(np.fft.rfft(error * np.hanning(n))) ** 2
    power[1 : (n + 1) // 2] *= 2.0  # both signs of a frequency
    frequency = np.fft.rfftfreq(n, samples.dt)
    place = np.clip(np.searchsorted(edges, frequency, side="left") - 1, 0, len(edges) - 2)
    total = np.bincount(place, power, minlength=len(edges) - 1)
    scale = float(np.sum(error**2)) / samples.counted / max(float(power.sum()), 1e-300)
    filled = (np.bincount(place, minlength=len(edges) - 1) > 0) & (width > 0.0)
    return np.where(filled, np.sqrt(total * scale), np.nan), np.where(filled, white, np.nan)


BINS = 16
"""Bins along the axis."""

FEWEST_FOR_MEAN = 20
"""Samples in a cell; the mean of fewer is noise."""

TAILS = 0.5
"""Per cent on each side in the outermost bins: a few fast samples must not stretch the axis."""

QUANTITIES: dict[str, Callable[[str], str]] = {
    "position": lambda unit: unit,
    "velocity": lambda unit: f"{unit}/s",
    "acceleration": lambda unit: f"{unit}/s²",
    "deflection": lambda unit: "m",
}
"""Quantity of a joint's motion that an error may depend on -> its unit, from the joint's unit."""


@dataclass(frozen=True)
class _Samples:
    """One channel's counted errors (N,) over all recordings, and the motion then."""

    unit: str
    error: np.ndarray
    motion: JointMotion


def errors_over(
    comparisons: Sequence[RecordingComparison], floors: Mapping[str, float]
) -> tuple[ErrorOver, ...]:
    """Each channel over each quantity of each joint, the clearest pattern first."""
    records = []
    for channel, floor in floors.items():
        samples = _all_samples(comparisons, channel)
        if samples is None:
            continue
        for quantity in QUANTITIES:
            for k in range(len(samples.motion.units)):
                record = _error_over(channel, samples, quantity, k, floor)
                if record is not None:
                    records.append(record)
    return tuple(sorted(records, key=lambda record: -record.explained))


def _all_samples(comparisons: Sequence[RecordingComparison], channel: str) -> _Samples | None:
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


def _error_over(
    channel: str, samples: _Samples, quantity: str, k: int, floor: float
) -> ErrorOver | None:
    x = getattr(samples.motion, quantity)[:, k]
    finite = np.isfinite(x)
    x, error = x[finite], samples.error[finite]
    if x.size < 2 * FEWEST_FOR_MEAN or np.ptp(x) == 0.0:
        return None
    low, high = np.percentile(x, [TAILS, 100.0 - TAILS])
    edges = np.linspace(low, high, BINS + 1) if high > low else np.linspace(x.min(), x.max(), 2)
    backwards = samples.motion.velocity[finite, k] < 0.0
    bins = len(edges) - 1
    place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, bins - 1) + bins * backwards
    count = np.bincount(place, minlength=2 * bins)
    mean = np.bincount(place, error, minlength=2 * bins) / np.maximum(count, 1)
    square = np.bincount(place, error**2, minlength=2 * bins) / np.maximum(count, 1)
    few = count < FEWEST_FOR_MEAN
    return ErrorOver(
        channel=channel, unit=samples.unit, quantity=quantity, joint=k + 1,
        quantity_unit=QUANTITIES[quantity](samples.motion.units[k]), edges=edges,
        mean=np.where(few, np.nan, mean).reshape(2, bins),
        rms=np.where(few, np.nan, np.sqrt(square)).reshape(2, bins), count=count.reshape(2, bins),
        floor=floor, explained=_explained(error, place % bins, bins),
    )  # fmt: skip


def _explained(error: np.ndarray, place: np.ndarray, bins: int) -> float:
    """The correlation ratio: variance between the bins over all variance, both directions together.
    Dependence on the direction alone would otherwise be a pattern over every quantity."""
    centred = error - error.mean()
    whole = float(np.sum(centred**2))
    count = np.bincount(place, minlength=bins)
    total = np.bincount(place, centred, minlength=bins)
    between = float(np.sum(total**2 / np.maximum(count, 1)))
    return between / whole if whole > 0.0 else 0.0
