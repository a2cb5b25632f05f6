"""Gain, lag and drift of the lag between signals, by regression of their rates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import NamedTuple

import numpy as np
import scipy

from ..least_squares import pseudo_inverse

LOOP, DIRECT, NEWTON = 0.25, 0.12, 1.1
"""|ln gain| that is no fault. LOOP: dry friction takes 10 %, a payload as much (scenarios/mujoco);
DIRECT: a real drive's current follows its reference within 7 %; NEWTON: apparent inertias are 1.5
to 2.5 times the nominal ones."""
LEAST_EXPLAINED = 0.5
"""Share of variance explained, below which a gain means nothing."""
GAIN_EXPLAINED = 0.85
"""Share explained above which a gain of the loop or of a torque counts (another arm explains less);
below, only its sign does."""
LAG_EXPLAINED = 0.985
"""Share explained above which a lag is a delay and no other dynamics. With elastic joints in
scenarios/mujoco it stays below 0.98, with a late camera it is 0.987 to 0.999; of a torque EMPS has
0.998, a bench with soft links 0.92. The loop must explain every encoder as well: elastic joints,
which delay the tip, leave 0.9 or less; a stiffness error of 30 % leaves 0.978 or less and turns a
delay of 6 ms into 4 (scenarios/mujoco/plain)."""
LAGS = 0.25
"""s, the longest delay sought."""
CONVERGED = 1e-3
"""Samples by which the last iteration may change a lag."""


@dataclass(frozen=True)
class Relation:
    """`output` is `gain` times its prediction from `inputs`, `lag` later."""

    output: str
    inputs: tuple[str, ...]
    gain: float
    lag: float
    """s"""
    drift: float
    """s/s: by how much the lag grows."""
    drift_error: float
    """s/s, its standard deviation."""
    explained: float
    """Share of the output's variance."""
    tolerance: float
    """|ln gain| that is no fault; infinite: only the sign is known."""
    expected: np.ndarray | None = None
    """(M,) on the even clock, of the output."""
    step: float = 0.0
    """s, the sample time."""

    @property
    def key(self) -> tuple[str, tuple[str, ...]]:
        """Identity of a relation: output and inputs."""
        return self.output, self.inputs

    @property
    def timeless(self) -> Relation:
        """The relation without its lag, if that depends on unknown dynamics."""
        if self.tolerance == DIRECT:
            return self
        return replace(self, lag=np.inf, drift=0.0, drift_error=np.inf)


def relate(
    output: str, inputs: tuple[str, ...], y: np.ndarray, expected: Sequence[np.ndarray],
    dt: float, tolerance: float,
) -> Relation | None:  # fmt: skip
    """Regress a channel y (M,) on its prediction, the sum of one `expected` (M,) per input: gain,
    lag and drift of the lag; `dt` in s. The gain is that of the only input, or of their sum. None
    where nothing is explained."""
    x = np.sum(expected, axis=0)
    if not (np.std(x) > 0 and np.std(y) > 0):
        return None
    moves = smoothed(np.array([y, x]))
    lag, explained = best_lag(moves[0], moves[1], dt)
    if explained < 0.02:
        return Relation(output, inputs, 1.0, 0.0, 0.0, np.inf, explained, tolerance, x, dt)
    fit = fit_gains_and_lags(moves[0], moves[1:], dt, lag, drifts=True)
    return Relation(
        output, inputs, float(fit.gains[0]), float(fit.lags[0]), fit.drift, fit.drift_error,
        fit.explained, tolerance, x, dt,
    )  # fmt: skip


SLOW = 0.2
"""Of half the sampling rate: what is faster is noise."""


def smoothed(x: np.ndarray) -> np.ndarray:
    """Signals (..., M) from their first values on, without what is faster than SLOW."""
    if x.shape[-1] <= 20:
        return x
    return np.asarray(scipy.signal.sosfiltfilt(_low_pass(), x - x[..., :1]))


@cache
def _low_pass() -> np.ndarray:
    return np.asarray(scipy.signal.butter(2, SLOW, output="sos"))


def best_lag(y: np.ndarray, x: np.ndarray, dt: float) -> tuple[float, float]:
    """The lag (s) at which the rates of smoothed signals agree best, and the share explained."""
    a, b = np.diff(x), np.diff(y)
    a, b = a - a.mean(), b - b.mean()
    most = min(int(LAGS / dt), len(a) // 4)
    whole = scipy.signal.correlate(b, a, mode="full", method="fft")
    middle = len(a) - 1
    near_zero = whole[middle - most : middle + most + 1]
    size = float(np.sqrt(np.sum(a * a) * np.sum(b * b)))
    if size == 0:
        return 0.0, 0.0
    k = int(np.argmax(np.abs(near_zero)))
    return (k - most) * dt, float(near_zero[k] / size) ** 2


class Regression(NamedTuple):
    """A signal as a sum of others."""

    part: np.ndarray
    """(k,) of each"""
    errors: np.ndarray
    """(k,), their standard deviations"""
    explained: float
    """Share of its variance."""


ALIKE = 10.0
"""Neighbouring errors are correlated: one in so many is independent."""


def regress(A: np.ndarray, y: np.ndarray) -> Regression:
    """y (M,) by columns A (M, k)."""
    inverse = pseudo_inverse(A.T @ A)
    part = inverse @ (A.T @ y)
    variance = float(np.var(y - A @ part))
    errors = np.sqrt(ALIKE * variance * np.abs(np.diag(inverse)))
    return Regression(part, errors, 1.0 - variance / max(float(np.var(y)), 1e-300))


class GainsAndLags(NamedTuple):
    """How a signal follows others."""

    gains: np.ndarray
    """(k,) of each; none is zero"""
    lags: np.ndarray
    """(k,) s"""
    drift: float
    """s/s, of all lags"""
    drift_error: float
    """Its standard deviation, infinite where it was not asked for."""
    explained: float
    """Share of the variance of its moves."""
    shares: np.ndarray
    """(k,), that of each by itself"""


def fit_gains_and_lags(
    y: np.ndarray, parts: np.ndarray, dt: float, lag: float | np.ndarray, drifts: bool = False
) -> GainsAndLags:
    """Gauss-Newton on the rate of a smoothed y (M,), with free gain and lag of each of the smoothed
    parts (k, M). The lags begin at `lag` s, one or (k,), and may change
    with time if it `drifts`; `dt` in s."""
    t, k = dt * np.arange(len(y)), len(parts)
    ys, rates = (np.gradient(each, dt, axis=-1) for each in (y, parts))
    middle, lags, drift, error = t - t[-1] / 2, np.full(k, lag), 0.0, np.inf
    for _ in range(8):
        when = t - lags[:, None] - drift * middle
        inside = np.all((when >= t[0]) & (when <= t[-1]), axis=0)
        moved = np.array([np.interp(a, t, rate) for a, rate in zip(when, rates, strict=True)])
        slopes = -np.gradient(moved, dt, axis=1)
        growing = [middle * slopes.sum(axis=0)] if drifts else []
        A = np.vstack([moved, slopes, *growing, np.ones_like(t)]).T[inside]
        fit = regress(A, ys[inside])
        gains = np.where(fit.part[:k] == 0.0, 1.0, fit.part[:k])
        later = np.clip(fit.part[k : 2 * k] / gains, -20.0 * dt, 20.0 * dt)
        lags = lags + later
        if drifts:
            growth = float(np.clip(fit.part[2 * k] / gains[0], -0.02, 0.02))
            drift, error = drift + growth, float(fit.errors[2 * k] / abs(gains[0]))
            later = np.append(later, growth * t[-1])
        if np.any(np.abs(lags) > 2 * LAGS) or np.all(np.abs(later) < CONVERGED * dt):
            break
    shares = np.var(gains[:, None] * moved, axis=1) / max(float(np.var(ys)), 1e-300)
    return GainsAndLags(gains, lags, drift, error, fit.explained, shares)
