"""The noise of a channel."""

from __future__ import annotations

import numpy as np


def noise_of(x: np.ndarray) -> float:
    """Standard deviation of white noise in a smooth signal (N,), by its third differences."""
    if len(x) < 10:
        return 0.0
    # The variance of the third difference of white noise is 20 times its own.
    return 1.4826 * float(np.median(np.abs(np.diff(x, 3)))) / np.sqrt(20.0)
