"""Autoregressive whitening: what is left when nothing predictable is left.

The noise model is fitted to what remains after the nuisance *and* all candidates are projected
out. Fitted to the raw residual it would whiten the effect away (Bacher & Madsen 2011 fit the
noise together with the model for the same reason).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from core.identify.prepared import Prepared

HIGHEST_ORDER = 6
"""Sensor noise coloured by a filter or a vibration needs two to four."""

FLOOR = 1e-300


@dataclass(frozen=True)
class Whitener:
    """One filter 1 - a_1 z^-1 - ... per channel, divided by the innovation's deviation."""

    filters: tuple[np.ndarray, ...]
    deviations: np.ndarray
    """(k,) of the innovations, in floors."""
    apart: int = 1
    """Every so many rows are kept."""

    def __call__(self, block: np.ndarray) -> np.ndarray:
        """(M, k, ...) -> (M / apart, k, ...) whitened along time."""
        block = block[:: self.apart]
        out = np.empty_like(block)
        for c, taps in enumerate(self.filters):
            out[:, c] = scipy.signal.lfilter(taps, [1.0], block[:, c], axis=0) / self.deviations[c]
        return out


def no_whitening(channels: int) -> Whitener:
    """Leaves everything as it is."""
    return Whitener((np.ones(1),) * channels, np.ones(channels))


LEFT = 0.3
"""Share of a signal that a filter leaves at the highest frequency that is kept for whitening. From
a half to a thirtieth p-values of noise are uniform behind filters of 10 to 50 Hz."""


def rows_apart(experiments: Sequence[Prepared]) -> int:
    """Every so many rows hold all that the filters let through.

    Beyond a filter's band there is nothing but rounding and the simulations' own error. Whitening
    lifts that to the height of the noise, where it is the same in model and effect: of a complete
    model behind a filter of 11 Hz it made p-values of 1e-186.
    """
    if any(not e.counted.all() for e in experiments):
        return 1  # a slower sensor has its samples at places of its own
    found = []
    for e in experiments:
        filters = [f for f in (e.processing.filter, e.processing.output_filter) if f is not None]
        highest = min((f.reach_hz(LEFT) for f in filters), default=np.inf)
        rate = 1.0 / (e.recording.sample_time * e.processing.decimate)
        found.append(max(int(rate / (2.0 * highest)), 1))
    return min(found, default=1)


def fit_whitener(remainders: Sequence[np.ndarray], apart: int = 1) -> Whitener:
    """From what remains (M, k) per recording, every so many rows `apart`; the order is the one of
    least AIC."""
    filters, deviations = [], []
    for c in range(remainders[0].shape[1]):
        taps, deviation = _best([r[::apart, c] for r in remainders])
        filters.append(taps)
        deviations.append(deviation)
    return Whitener(tuple(filters), np.array(deviations), apart)


def _best(pieces: Sequence[np.ndarray]) -> tuple[np.ndarray, float]:
    count = sum(len(x) for x in pieces)
    gamma = sum(_autocovariance(x, HIGHEST_ORDER) for x in pieces) / max(count, 1)
    gamma = np.asarray(gamma)
    if gamma[0] <= FLOOR:
        return np.ones(1), 1.0
    found = []
    for order in range(HIGHEST_ORDER + 1):
        a = scipy.linalg.solve_toeplitz(gamma[:order], gamma[1 : order + 1]) if order else []
        variance = float(gamma[0] - np.dot(a, gamma[1 : order + 1]))
        if variance > FLOOR:
            aic = count * np.log(variance) + 2.0 * order
            found.append((aic, np.concatenate([[1.0], -np.asarray(a)]), np.sqrt(variance)))
    _, taps, deviation = min(found, key=lambda item: item[0])
    return taps, float(deviation)


def _autocovariance(x: np.ndarray, lags: int) -> np.ndarray:
    """(lags + 1,) sums of x(t) x(t + lag)."""
    return np.array([np.dot(x[: len(x) - lag], x[lag:]) for lag in range(lags + 1)])
