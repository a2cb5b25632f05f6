"""Where a signal is cut off."""

from __future__ import annotations

import numpy as np

from core.check.measured import lattice_step

SHARE = 0.01
"""Of the samples; recordings of real rigs have 0.2 % at their largest value."""
FEWEST = 8
NEAR = 0.02
"""Of the range: a smooth turning point has more samples just below its top than at it."""
FAST = 0.25
"""Of the usual speed: a signal runs into a limit, an encoder at rest does not."""


def limit_of(values: np.ndarray) -> tuple[float, float] | None:
    """(the value at which a signal (N,) is cut off, share of its samples there), or None."""
    x = values[np.isfinite(values)]
    if len(x) < 5 * FEWEST or np.ptp(x) == 0.0:
        return None
    found = [each for each in (_at(x, x.max(), 1.0), _at(x, x.min(), -1.0)) if each is not None]
    return max(found, key=lambda one: one[1]) if found else None


def _at(x: np.ndarray, top: float, side: float) -> tuple[float, float] | None:
    at = x == top
    count = int(at.sum())
    levels = np.unique(x)
    step = float(np.median(np.diff(levels)))
    below = side * (top - x)
    near = int(np.sum((below > 0) & (below <= max(NEAR * float(np.ptp(x)), 3.0 * step))))
    if count < max(FEWEST, SHARE * len(x)) or count <= near:
        return None
    edges = np.flatnonzero(np.diff(at.astype(int)) != 0)
    if len(edges) == 0 or not np.any(at[1:] & at[:-1]):
        return None
    if lattice_step(x) > 0 and len(edges) <= 2:
        return None  # where dry friction holds a joint once, an encoder repeats a value as well
    speed = np.abs(np.diff(x))
    usual = float(np.sqrt(np.mean(speed**2)))
    # Two samples before the limit and two after it.
    around = [speed[np.clip([k - 1, k, k + 1], 0, len(speed) - 1)].max() for k in edges]
    return (float(top), count / len(x)) if np.median(around) > FAST * usual else None
