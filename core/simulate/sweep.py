"""A smooth sweep of one joint over its range."""

import numpy as np


def half_cosine_rate(start: float, stop: float, samples: int, dt: float) -> np.ndarray:
    """(samples,) velocity of the smooth move start -> stop over the whole recording:
    theta(t) = start + (stop - start) (1 - cos(pi t / T)) / 2."""
    T = samples * dt
    t = np.arange(samples) * dt + dt / 2.0  # the mean velocity over each held sample
    return (stop - start) * np.pi / (2.0 * T) * np.sin(np.pi * t / T)
