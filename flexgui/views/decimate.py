"""Fewer points for the same picture: the least and the greatest of each stretch survive."""

from __future__ import annotations

import numpy as np

POINTS = 2000
"""Enough for a plot 2000 pixels wide; more only makes the report heavy."""
GAP = 5.0
"""A pause longer than this many usual steps breaks the line."""


def decimate(time: np.ndarray, values: np.ndarray, points: int = POINTS) -> np.ndarray:
    """Indices (k,), k <= points, that keep the least and the greatest finite value per stretch."""
    index = np.flatnonzero(np.isfinite(values) & np.isfinite(time))
    if index.size <= points:
        return index
    width = -(-index.size // (points // 2))
    padded = np.concatenate([index, np.repeat(index[-1:], -index.size % width)])
    stretches = padded.reshape(-1, width)
    inside = values[stretches]
    rows = np.arange(len(stretches))
    least = stretches[rows, np.argmin(inside, axis=1)]
    greatest = stretches[rows, np.argmax(inside, axis=1)]
    return np.unique(np.concatenate([least, greatest]))


def trace(
    time: np.ndarray, values: np.ndarray, points: int = POINTS
) -> tuple[np.ndarray, np.ndarray]:
    """A line to draw, float32: decimated, and broken (NaN) where samples are missing for long."""
    present = np.flatnonzero(np.isfinite(values) & np.isfinite(time))
    index = decimate(time, values, points)
    x, y = time[index].astype(np.float32), values[index].astype(np.float32)
    if index.size < 2:
        return x, y
    steps = np.diff(time[present])
    starts = present[np.flatnonzero(steps > GAP * np.median(steps))]
    breaks = np.unique(np.searchsorted(index, starts, side="right"))
    breaks = breaks[(breaks > 0) & (breaks < index.size)]
    return np.insert(x, breaks, x[breaks - 1]), np.insert(y, breaks, np.float32(np.nan))
