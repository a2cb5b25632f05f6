"""What an estimated first state explains of an error that shakes a led arm from its start.

Where a recording begins in motion, the speed of its joints comes from the first samples: their
noise, and what a spline misses there, makes the arm swing to the end. A fit that estimates the
first state takes that out, so it is no part of a noise floor; floors were thirty times too high.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from core.identify.unknowns import START

SMALL = 1e-4
"""m or m/s at a tip, by which a first state is changed: a thousandth of what arms swing by, so that
what follows is in proportion."""

AGAIN = 2
"""Times that channels are weighed: by the shaken error, and by what is left of it."""


def answers_to(
    values: Mapping[str, float],
    plain: np.ndarray,
    compared: Callable[[Mapping[str, float]], np.ndarray],
) -> np.ndarray | None:
    """(M, k, S): how what is `compared` changes with each estimated number of the first state from
    what it is at some values, `plain` (M, k); None where none is estimated."""
    names = [name for name in values if name.startswith(START)]
    if not names:
        return None
    changed = [compared({**values, n: values[n] + SMALL}) - plain for n in names]
    return np.stack(changed, axis=-1)


def without(error: np.ndarray, answers: np.ndarray | None) -> np.ndarray:
    """An error (M, k) less what some combination of `answers` (M, k, S) explains of it, each
    channel weighed by what is left of it. NaN where nothing was measured, as before."""
    if answers is None:
        return error
    known = np.isfinite(error) & np.isfinite(answers).all(axis=-1)
    whole, columns = np.where(known, error, 0.0), np.where(known[..., None], answers, 0.0)
    left = whole
    for _ in range(AGAIN):
        sizes = np.sqrt(np.mean(left**2, axis=0))
        weights = np.divide(1.0, sizes, out=np.zeros_like(sizes), where=sizes > 0.0)
        rows = (columns * weights[:, None]).reshape(whole.size, -1)
        sizes = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
        change = np.linalg.lstsq(rows / sizes, (whole * weights).ravel(), rcond=1e-9)[0] / sizes
        left = whole - columns @ change
    return np.where(np.isfinite(error), left, np.nan)
