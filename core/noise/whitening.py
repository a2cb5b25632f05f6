"""Autoregressive whitening of residuals.

Each channel is whitened along its own samples: those of a slow camera follow one another across
empty rows, and masked samples do not count. The noise model is fitted to what remains after the
nuisance *and* all candidates are projected out. Fitted to the raw residual it would whiten the
effect away (Bacher & Madsen 2011 fit the noise together with the model for the same reason).

Each sample is predicted from earlier samples at their actual distances by the autocovariance of an
autoregression (Vecchia 1988). Along an unbroken series the weights are the autoregression's
coefficients; of a first-order one the prediction across a gap is exact, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.lib.stride_tricks import sliding_window_view

from ..identify.prepared_recording import Prepared
from ..results import ErrorProducts

HIGHEST_ORDER = 6
"""Sensor noise correlated by a filter or a vibration needs two to four."""

LONGEST_LAG = 1000
"""Lag in samples beyond which noise counts as independent."""

SMALLEST_VARIANCE = float(np.finfo(float).tiny)
"""Of a variance, against division by zero."""
ROUNDING = 64 * float(np.finfo(float).eps)
"""Of a variance: less is rounding."""


@dataclass(frozen=True)
class ChannelPrediction:
    """Prediction of one channel's samples in one recording from earlier ones."""

    rows: np.ndarray
    """(n,) rows of the whitened samples"""
    weights: np.ndarray
    """(n, p) weights of the p samples before each"""
    deviation: np.ndarray
    """(n,) standard deviation of the prediction error, in noise floors"""

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
        """Whitened samples (K, ...) of recording `i` in a block (M, k, ...), one channel after the
        other."""
        channels = enumerate(self.predictions[i])
        return np.concatenate([prediction.whitened(block[:, c]) for c, prediction in channels])


def no_whitening(i: int, block: np.ndarray) -> np.ndarray:
    """A block (M, k, ...) of recording `i` unchanged, (M k, ...)."""
    return block.reshape(-1, *block.shape[2:])


LEAST_GAIN = 0.3
"""Gain of a filter at the highest frequency that is whitened. From a half to a thirtieth, p-values
of noise are uniform behind filters of 10 to 50 Hz."""


def whitened_rows(experiments: Sequence[Prepared]) -> list[list[np.ndarray]]:
    """Per recording the rows of each channel that count, thinned to the bandwidth of the filters.

    Beyond a filter's band there is only rounding and simulation error, equal in model and effect.
    Whitening would amplify it to the level of the noise: a complete model behind a filter of 11 Hz
    got p-values of 1e-186.
    """
    return [_rows(e) for e in experiments]


def _rows(e: Prepared) -> list[np.ndarray]:
    rate = 1.0 / (e.recording.sample_time * e.processing.decimate)
    rows = []
    for kind, mask in zip(e.kinds, e.counted.T, strict=True):
        reach = [f.reach_hz(LEAST_GAIN) for f in e.processing.filters(kind)]
        rows.append(thinned(np.flatnonzero(mask), rate / (2.0 * min(reach, default=np.inf))))
    return rows


def thinned(rows: np.ndarray, distance: float) -> np.ndarray:
    """Rows (n,) that are a `distance` in samples or more from one another."""
    every = int(distance / _usual_distance(rows))
    return rows if every < 2 else rows[_steps(rows) % every == 0]


def _usual_distance(rows: np.ndarray) -> float:
    return float(np.median(np.diff(rows))) if len(rows) > 1 else 1.0


def _steps(rows: np.ndarray) -> np.ndarray:
    """(n,) number of each sample, in units of the usual distance of these rows."""
    if len(rows) < 2:
        return np.zeros(len(rows), dtype=int)
    distances = np.maximum(np.round(np.diff(rows) / _usual_distance(rows)), 1.0)
    return np.concatenate([[0], np.cumsum(distances)]).astype(int)


def fit_whitener(
    remainders: Sequence[np.ndarray], rows: Sequence[Sequence[np.ndarray]]
) -> Whitener:
    """The noise models of the remainders (M, k) per recording, in noise floors, each of the order
    of least AIC. `rows`: per recording and channel the rows (n,) that are whitened."""
    channels = [
        _fit_channel([(r[:, c], own[c]) for r, own in zip(remainders, rows, strict=True)])
        for c in range(remainders[0].shape[1])
    ]
    return Whitener(tuple(zip(*channels, strict=True)))


def _fit_channel(series: Sequence[tuple[np.ndarray, np.ndarray]]) -> list[ChannelPrediction]:
    """Per recording, from a channel's remainders (M,) and the rows (n,) that are whitened."""
    autocovariance = _autocovariance([(x[rows], _steps(rows)) for x, rows in series])
    predictions = [_predict_channel(rows, autocovariance) for _, rows in series]
    whitened = np.concatenate(
        [p.whitened(x) for p, (x, _) in zip(predictions, series, strict=True)]
    )
    size = float(np.sqrt(np.mean(whitened**2))) if np.any(whitened) else 1.0
    # So that noise costs as much as it has samples, whatever the autoregression misses.
    return [replace(p, deviation=size * p.deviation) for p in predictions]


@dataclass(frozen=True)
class _Autocovariance:
    """Autocovariance of an autoregression."""

    order: int
    gamma: np.ndarray
    """(LONGEST_LAG + 1,)"""


def _autocovariance(pieces: Sequence[tuple[np.ndarray, np.ndarray]]) -> _Autocovariance:
    """The autocovariance, from values (n,) and the numbers (n,) of their samples.

    Burg's method for segments (de Waele & Broersen 2000). Each order uses the rows that have all
    its samples: means over different pairs contradict each other, which AIC took for correlation.
    """
    forward = backward = _on_grid(pieces)
    values = forward[np.isfinite(forward)]
    variance = float(values @ values) / max(len(values), 1)
    if variance <= SMALLEST_VARIANCE:
        return _Autocovariance(0, _extended(np.ones(1), np.zeros(0)))
    gamma, taps, best, criterion, least = [variance], np.zeros(0), np.zeros(0), 0.0, 0.0
    for _ in range(HIGHEST_ORDER):
        forward, backward = forward[1:], backward[:-1]
        rows = np.isfinite(forward + backward)
        f, b = forward[rows], backward[rows]
        reflection = 2.0 * float(f @ b) / max(float(f @ f + b @ b), SMALLEST_VARIANCE)
        gamma.append(float(taps @ gamma[:0:-1]) + reflection * variance)
        variance *= 1.0 - reflection**2
        if variance <= SMALLEST_VARIANCE:
            break
        taps = np.append(taps - reflection * taps[::-1], reflection)
        forward, backward = forward - reflection * backward, backward - reflection * forward
        criterion += len(f) * float(np.log1p(-(reflection**2))) + 2.0
        if criterion < least:
            least, best = criterion, taps
    return _Autocovariance(len(best), _extended(np.array(gamma[: len(best) + 1]), best))


def _on_grid(pieces: Sequence[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """All pieces on one even grid, HIGHEST_ORDER samples apart; NaN where there is no value."""
    grids = []
    for x, steps in pieces:
        grid = np.full(steps.max(initial=-1) + 1 + HIGHEST_ORDER, np.nan)
        grid[steps] = x
        grids.append(grid)
    return np.concatenate(grids)


def _extended(gamma: np.ndarray, taps: np.ndarray) -> np.ndarray:
    """The autocovariance (LONGEST_LAG + 1,), continued by the autoregression."""
    extension = np.zeros(LONGEST_LAG + 1)
    extension[: len(gamma)] = gamma
    if len(taps):
        a = np.concatenate([[1.0], -taps])
        state = scipy.signal.lfiltic([1.0], a, gamma[:0:-1])
        beyond, _ = scipy.signal.lfilter([1.0], a, np.zeros(LONGEST_LAG + 1 - len(gamma)), zi=state)
        extension[len(gamma) :] = beyond
    return extension


def _predict_channel(rows: np.ndarray, autocovariance: _Autocovariance) -> ChannelPrediction:
    """Best linear prediction of each sample from as many earlier ones as the order."""
    n, p, gamma = len(rows), autocovariance.order, autocovariance.gamma
    if not p or not n:
        return ChannelPrediction(rows, np.zeros((n, p)), np.full(n, np.sqrt(gamma[0])))
    lags = np.zeros((n, p), dtype=int)  # 0: there is no such sample
    steps = _steps(rows)
    for j in range(p):
        lags[j + 1 :, j] = steps[j + 1 :] - steps[: -(j + 1)]
    kinds, which = np.unique(lags, axis=0, return_inverse=True)
    present = (kinds > 0) & (kinds <= LONGEST_LAG)
    distances = np.minimum(np.abs(kinds[:, :, None] - kinds[:, None, :]), LONGEST_LAG)
    both = present[:, :, None] & present[:, None, :]
    among = np.where(both, gamma[distances], 0.0) + (ROUNDING + ~present)[:, None] * gamma[
        0
    ] * np.eye(p)
    to = np.where(present, gamma[np.minimum(kinds, LONGEST_LAG)], 0.0)
    a = np.linalg.solve(among, to[:, :, None])[:, :, 0]
    deviation = np.sqrt(np.maximum(gamma[0] - np.sum(a * to, axis=1), SMALLEST_VARIANCE))
    return ChannelPrediction(rows, a[which.ravel()], deviation[which.ravel()])


def error_products(
    experiments: Sequence[Prepared], errors: Sequence[np.ndarray], weights: Sequence[np.ndarray],
    parameters: int, prior: float = 0.0,
) -> ErrorProducts:  # fmt: skip
    """The inner products of the errors (M, k) per recording, which are weighted by `weights` (k,).

    Args:
        experiments: The recordings.
        errors: Of a model, times the weights.
        weights: One over the unit that the errors are in.
        parameters: That the model estimates.
        prior: What is known a priori, in squares of its deviations.
    """
    rows, channels = whitened_rows(experiments), range(len(weights[0]))
    windows = [
        np.concatenate([
            _windows(r[own[c], c] / (w[c] or np.nan), _steps(own[c]))
            for r, w, own in zip(errors, weights, rows, strict=True)
        ])
        for c in channels
    ]  # fmt: skip
    return ErrorProducts(
        np.array([x.T @ x for x in windows]),
        np.array([len(x) for x in windows]),
        np.array([_variance([e.measured[e.counted[:, c], c] for e in experiments])
                  for c in channels]),
        parameters, prior,
    )  # fmt: skip


def _windows(x: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """(n, HIGHEST_ORDER + 1): samples x (N,) with those before them, the latest first, where none
    of them is missing; `numbers` (N,) of the samples."""
    grid = np.full(max(numbers.max(initial=-1), HIGHEST_ORDER) + 1, np.nan)
    grid[numbers] = x
    windows = sliding_window_view(grid, HIGHEST_ORDER + 1)[:, ::-1]
    return windows[np.isfinite(windows).all(axis=1)]


def _variance(parts: Sequence[np.ndarray]) -> float:
    """Mean square about each part's own mean."""
    about = [y - y.mean() for y in parts if len(y)]
    return float(np.mean(np.concatenate(about) ** 2)) if about else 0.0
