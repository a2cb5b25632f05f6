"""Autoregressive whitening: what is left when nothing predictable is left.

Each channel is whitened along its own samples: those of a slow camera follow one another although
rows without any lie between, and what is masked does not count. The noise model is fitted to what
remains after the nuisance *and* all candidates are projected out. Fitted to the raw residual it
would whiten the effect away (Bacher & Madsen 2011 fit the noise together with the model for the
same reason).

With the autocovariance of an autoregression, each sample is predicted from the samples before it at
the distances that they have (Vecchia 1988): along an unbroken series these are the autoregression's
own coefficients, and of a first-order one the prediction across a gap is exact, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from ..identify.prepared import Prepared

HIGHEST_ORDER = 6
"""Sensor noise coloured by a filter or a vibration needs two to four."""

LONGEST_LAG = 1000
"""Samples of a channel beyond which its noise is taken to be independent."""

SMALLEST = 1e-300
"""Of a variance: no division by zero."""
ROUNDING = 1e-14
"""Of a variance: less is rounding."""


@dataclass(frozen=True)
class ChannelPrediction:
    """How the samples of one channel in one recording follow from those before."""

    rows: np.ndarray
    """(n,) of the samples that are whitened"""
    weights: np.ndarray
    """(n, p) of the p samples before each"""
    deviation: np.ndarray
    """(n,) of what they do not predict, in noise floors"""

    def whitened(self, x: np.ndarray) -> np.ndarray:
        """(n, ...) of the channel's rows x (M, ...)."""
        own = x[self.rows]
        shape = (len(own),) + (1,) * (own.ndim - 1)
        out = own.copy()
        for j in range(self.weights.shape[1]):
            out[j + 1 :] -= self.weights[j + 1 :, j].reshape(-1, *shape[1:]) * own[: -(j + 1)]
        return np.asarray(out / self.deviation.reshape(shape))


@dataclass(frozen=True)
class Whitener:
    """One noise model per channel, applied to the samples of each recording."""

    predictions: tuple[tuple[ChannelPrediction, ...], ...]
    """Per recording and channel."""

    def __call__(self, i: int, block: np.ndarray) -> np.ndarray:
        """The samples of recording `i` in a block (M, k, ...), whitened along time, one channel
        after the other: (K, ...)."""
        channels = enumerate(self.predictions[i])
        return np.concatenate([one.whitened(block[:, c]) for c, one in channels])


def no_whitening(i: int, block: np.ndarray) -> np.ndarray:
    """A block (M, k, ...) of recording `i` as it is, (M k, ...)."""
    return block.reshape(-1, *block.shape[2:])


LEFT = 0.3
"""Share of a signal that a filter leaves at the highest frequency that is kept for whitening. From
a half to a thirtieth p-values of noise are uniform behind filters of 10 to 50 Hz."""


def whitened_rows(experiments: Sequence[Prepared]) -> list[list[np.ndarray]]:
    """Per recording the rows of each channel that count and are far enough apart to hold no more
    than what the filters let through.

    Beyond a filter's band there is nothing but rounding and the simulations' own error. Whitening
    lifts that to the height of the noise, where it is the same in model and effect: of a complete
    model behind a filter of 11 Hz it made p-values of 1e-186.
    """
    return [_rows(e) for e in experiments]


def _rows(e: Prepared) -> list[np.ndarray]:
    rate = 1.0 / (e.recording.sample_time * e.processing.decimate)
    found = []
    for kind, mask in zip(e.kinds, e.counted.T, strict=True):
        reach = [f.reach_hz(LEFT) for f in e.processing.filters(kind)]
        found.append(thinned(np.flatnonzero(mask), rate / (2.0 * min(reach, default=np.inf))))
    return found


def thinned(rows: np.ndarray, apart: float) -> np.ndarray:
    """Of a channel's rows (n,) those that are `apart` rows or more from one another."""
    every = int(apart / _usual_distance(rows))
    return rows if every < 2 else rows[_steps(rows) % every == 0]


def _usual_distance(rows: np.ndarray) -> float:
    return float(np.median(np.diff(rows))) if len(rows) > 1 else 1.0


def _steps(rows: np.ndarray) -> np.ndarray:
    """(n,) the number of each sample, in the usual distance of these rows from one another."""
    if len(rows) < 2:
        return np.zeros(len(rows), dtype=int)
    distances = np.maximum(np.round(np.diff(rows) / _usual_distance(rows)), 1.0)
    return np.concatenate([[0], np.cumsum(distances)]).astype(int)


def fit_whitener(
    remainders: Sequence[np.ndarray], rows: Sequence[Sequence[np.ndarray]]
) -> Whitener:
    """The noise models of what remains, each of the order of least AIC.

    Args:
        remainders: (M, k) per recording, in noise floors.
        rows: Per recording and channel the rows (n,) that are whitened.
    """
    channels = [
        _fitted([(r[:, c], own[c]) for r, own in zip(remainders, rows, strict=True)])
        for c in range(remainders[0].shape[1])
    ]
    return Whitener(tuple(zip(*channels, strict=True)))


def _fitted(series: Sequence[tuple[np.ndarray, np.ndarray]]) -> list[ChannelPrediction]:
    """Per recording, from a channel's remainders (M,) and the rows (n,) that are whitened."""
    known = _autocovariance([(x[rows], _steps(rows)) for x, rows in series])
    found = [_prediction(rows, known) for _, rows in series]
    left = np.concatenate([p.whitened(x) for p, (x, _) in zip(found, series, strict=True)])
    size = float(np.sqrt(np.mean(left**2))) if np.any(left) else 1.0
    # Covariances over different pairs contradict each other a little where samples are missing.
    return [replace(p, deviation=size * p.deviation) for p in found]


@dataclass(frozen=True)
class _Autocovariance:
    """Of an autoregression."""

    order: int
    gamma: np.ndarray
    """(LONGEST_LAG + 1,)"""


def _autocovariance(pieces: Sequence[tuple[np.ndarray, np.ndarray]]) -> _Autocovariance:
    """From values (n,) and the numbers (n,) of the samples that they are."""
    dense = [_on_grid(x, steps) for x, steps in pieces if len(x)]
    count = sum(len(x) for x, _ in pieces)
    gamma = _lagged_products(dense)
    if gamma[0] <= SMALLEST:
        return _Autocovariance(0, _continued(np.ones(1), np.zeros(0)))
    taps, variance, best = np.zeros(0), gamma[0], (count * np.log(gamma[0]), np.zeros(0))
    for order in range(1, len(gamma)):  # Levinson and Durbin
        reflection = (gamma[order] - taps @ gamma[order - 1 : 0 : -1]) / variance
        variance *= 1.0 - reflection**2
        if not abs(reflection) < 1.0 or variance <= SMALLEST:
            break
        taps = np.append(taps - reflection * taps[::-1], reflection)
        best = min(best, (count * np.log(variance) + 2.0 * order, taps), key=lambda one: one[0])
    order = len(best[1])
    return _Autocovariance(order, _continued(gamma[: order + 1], best[1]))


def _on_grid(x: np.ndarray, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values and which of them there are, evenly sampled."""
    values, there = np.zeros(steps[-1] + 1), np.zeros(steps[-1] + 1)
    values[steps], there[steps] = x, 1.0
    return values, there


def _lagged_products(dense: Sequence[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """(up to HIGHEST_ORDER + 1,) means of x(t) x(t + lag) over the pairs that there are, times the
    share of an unbroken series that such pairs are; up to the first lag that has none."""
    found = []
    length = sum(len(x) for x, _ in dense)
    for lag in range(HIGHEST_ORDER + 1):
        inner = [(x, there) for x, there in dense if len(x) > lag]
        pairs = sum(float(there[: len(x) - lag] @ there[lag:]) for x, there in inner)
        if not pairs:
            break
        total = sum(float(x[: len(x) - lag] @ x[lag:]) for x, _ in inner)
        found.append(total / pairs * sum(len(x) - lag for x, _ in inner) / length)
    return np.array(found or [0.0])


def _continued(gamma: np.ndarray, taps: np.ndarray) -> np.ndarray:
    """An autocovariance (LONGEST_LAG + 1,) that goes on as the autoregression does."""
    found = np.zeros(LONGEST_LAG + 1)
    found[: len(gamma)] = gamma
    if len(taps):
        a = np.concatenate([[1.0], -taps])
        state = scipy.signal.lfiltic([1.0], a, gamma[:0:-1])
        beyond, _ = scipy.signal.lfilter([1.0], a, np.zeros(LONGEST_LAG + 1 - len(gamma)), zi=state)
        found[len(gamma) :] = beyond
    return found


def _prediction(rows: np.ndarray, known: _Autocovariance) -> ChannelPrediction:
    """Best linear predictions of each sample from as many before it as the order says."""
    n, p, gamma = len(rows), known.order, known.gamma
    if not p or not n:
        return ChannelPrediction(rows, np.zeros((n, p)), np.full(n, np.sqrt(gamma[0])))
    lags = np.zeros((n, p), dtype=int)  # 0: there is no such sample
    steps = _steps(rows)
    for j in range(p):
        lags[j + 1 :, j] = steps[j + 1 :] - steps[: -(j + 1)]
    kinds, which = np.unique(lags, axis=0, return_inverse=True)
    there = (kinds > 0) & (kinds <= LONGEST_LAG)
    apart = np.minimum(np.abs(kinds[:, :, None] - kinds[:, None, :]), LONGEST_LAG)
    both = there[:, :, None] & there[:, None, :]
    among = np.where(both, gamma[apart], 0.0) + (ROUNDING + ~there)[:, None] * gamma[0] * np.eye(p)
    to = np.where(there, gamma[np.minimum(kinds, LONGEST_LAG)], 0.0)
    a = np.linalg.solve(among, to[:, :, None])[:, :, 0]
    left = np.sqrt(np.maximum(gamma[0] - np.sum(a * to, axis=1), SMALLEST))
    return ChannelPrediction(rows, a[which.ravel()], left[which.ravel()])
