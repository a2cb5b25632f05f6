"""Below what an error says nothing about the model: the noise, and what a model may miss at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from core.identify.prepared import Prepared

DIFFERENCES = 3
"""Order of the differences that leave noise and take away what is smooth."""

NORMAL_MAD = 0.6744897501960817
"""Median of |x| for a standard normal x."""


def noise_of(error: np.ndarray) -> float:
    """Standard deviation of the white noise in one channel's error (N,), robustly.

    The differences of order d of white noise have the variance binomial(2 d, d) times its own;
    the median is not moved by the few places where the motion itself jumps.
    """
    x = np.asarray(error)[np.isfinite(error)]
    if len(x) <= 2 * DIFFERENCES:
        return 0.0
    d = np.diff(x, DIFFERENCES)
    gain = np.sqrt(20.0)  # binomial(6, 3)
    return float(np.median(np.abs(d)) / NORMAL_MAD / gain)


def channel_floors(
    experiments: Sequence[Prepared],
    errors: Sequence[np.ndarray],
    stated: Mapping[str, float],
    fidelity: float,
) -> dict[str, float]:
    """channel -> rms below which an error says nothing.

    `errors` (M, k) per recording, measured minus model; `stated` standard deviations by channel;
    `fidelity` the share of a channel's spread that no model of this kind is asked to explain.
    """
    floors = {}
    for name, values in _by_channel(experiments, errors).items():
        spread = np.concatenate([y - np.mean(y) for y, _ in values])
        noise = stated.get(name)
        if noise is None:
            noise = float(np.median([noise_of(e) for _, e in values]))
        size = float(np.sqrt(np.mean(spread**2)))
        floors[name] = float(np.hypot(noise, fidelity * size)) or 1e-12
    return floors


def _by_channel(
    experiments: Sequence[Prepared], errors: Sequence[np.ndarray]
) -> dict[str, list[tuple[np.ndarray, np.ndarray]]]:
    found: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {}
    for e, error in zip(experiments, errors, strict=True):
        for k, (name, _) in enumerate(e.channels):
            counts = e.counted[:, k]
            if counts.any():
                found.setdefault(name, []).append((e.measured[counts, k], error[counts, k]))
    return found
