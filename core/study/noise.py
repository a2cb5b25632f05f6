"""Sensor noise, white or coloured, of the same standard deviation."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

COLOUR = 0.9
"""Coefficient of the first-order autoregression at SAMPLE_TIME: noise with a memory of 10 ms."""

SAMPLE_TIME = 1e-3
"""s"""

COLOURS = {"white": 0.0, "coloured": COLOUR}
"""kind of noise -> coefficient."""


def noise(
    rng: np.random.Generator, samples: int, std: float, colour: float, dt: float = SAMPLE_TIME
) -> np.ndarray:
    """(samples,) of x(t) = a x(t - dt) + e(t), stationary from the first sample on.

    `colour` is a at SAMPLE_TIME; `std` is that of x whatever the colour.
    """
    e = rng.standard_normal(samples)
    if not colour:
        return std * e
    a = colour ** (dt / SAMPLE_TIME)
    own = np.sqrt(1.0 - a * a) * e[1:]
    x, _ = lfilter([1.0], [1.0, -a], own, zi=[a * e[0]])
    return np.asarray(std * np.concatenate([e[:1], x]))
