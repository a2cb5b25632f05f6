"""How one signal follows another: gain, lag and drift of the lag, by regression of their moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

LOOP, DIRECT, NEWTON = 0.25, 0.12, 1.1
"""Natural logarithm of a gain that is nobody's fault. LOOP: dry friction takes 10 %, a payload as
much (scenarios/mujoco); DIRECT: a real drive's current follows its reference within 7 %; NEWTON:
the apparent inertias of a bench are 1.5 to 2.5 times the nominal ones."""
WORTH = 0.5
"""Share of variance that must be explained before a gain means anything."""
LAGS = 0.25
"""s, the longest delay sought."""


@dataclass(frozen=True)
class Relation:
    """`output` is `gain` times what `inputs` say it should be, `lag` later."""

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
    """|ln gain| that is nobody's fault; infinite where only the sign is known."""
    expected: np.ndarray | None = None
    """(M,) on the even clock, of the output."""
    step: float = 0.0
    """s, the sample time."""

    @property
    def key(self) -> tuple[str, tuple[str, ...]]:
        """By which two relations are the same: output and inputs."""
        return self.output, self.inputs

    @property
    def timeless(self) -> Relation:
        """Without the lag where that depends on dynamics which nobody knows."""
        if self.tolerance == DIRECT:
            return self
        return replace(self, lag=np.inf, drift=0.0, drift_error=np.inf)


def compare(
    output: str, inputs: tuple[str, ...], y: np.ndarray, expected: Sequence[np.ndarray],
    dt: float, tolerance: float,
) -> Relation | None:  # fmt: skip
    """Regress a channel on what it should be: gains, lag and drift of the lag.

    Args:
        y: (M,) measured.
        expected: One (M,) per input.
        dt: s

    Returns:
        None where nothing is explained. The gain is that of the only input, or of their sum.
    """
    x = np.sum(expected, axis=0)
    if not (np.std(x) > 0 and np.std(y) > 0):
        return None
    lag, explained = _best_lag(y, x, dt)
    if explained < 0.02:
        return Relation(output, inputs, 1.0, 0.0, 0.0, np.inf, explained, tolerance, x, dt)
    gain, lag, drift, error, explained = _refined(y, x, lag, dt)
    return Relation(output, inputs, gain, lag, drift, error, explained, tolerance, x, dt)


SLOW = scipy.signal.butter(2, 0.2, output="sos")
"""Without the fastest tenth of a signal, where there is noise and no motion."""


def smoothed(x: np.ndarray) -> np.ndarray:
    """A signal (M,) from its first value on, without its fastest tenth."""
    return np.asarray(scipy.signal.sosfiltfilt(SLOW, x - x[0])) if len(x) > 20 else x


def _best_lag(y: np.ndarray, x: np.ndarray, dt: float) -> tuple[float, float]:
    """The lag (s) at which the moves of both agree best, and the share explained there."""
    a, b = np.diff(smoothed(x)), np.diff(smoothed(y))
    a, b = a - a.mean(), b - b.mean()
    most = min(int(LAGS / dt), len(a) // 4)
    whole = scipy.signal.correlate(b, a, mode="full", method="fft")
    middle = len(a) - 1
    around = whole[middle - most : middle + most + 1]
    size = float(np.sqrt(np.sum(a * a) * np.sum(b * b)))
    if size == 0:
        return 0.0, 0.0
    k = int(np.argmax(np.abs(around)))
    return (k - most) * dt, float(around[k] / size) ** 2


def _refined(
    y: np.ndarray, x: np.ndarray, lag: float, dt: float
) -> tuple[float, float, float, float, float]:
    """(gain, lag, drift, its deviation, share explained) by Gauss-Newton on the moves."""
    t = dt * np.arange(len(x))
    drift = 0.0
    xs, ys = smoothed(x), np.gradient(smoothed(y), dt)
    rate = np.gradient(xs, dt)
    gain, error, explained = 1.0, np.inf, 0.0
    for _ in range(6):
        when = t - lag - drift * (t - t[-1] / 2)
        inside = (when >= t[0]) & (when <= t[-1])
        p = np.interp(when, t, rate)
        slope = np.gradient(p, dt)
        columns = np.column_stack([p, -slope, -slope * (t - t[-1] / 2), np.ones_like(p)])[inside]
        part, *_ = np.linalg.lstsq(columns, ys[inside], rcond=None)
        rest = ys[inside] - columns @ part
        explained = 1.0 - float(np.var(rest) / max(np.var(ys[inside]), 1e-300))
        gain = float(part[0]) or 1.0
        # Neighbouring rests are alike: as many are independent as the smoothing leaves.
        spread = np.linalg.pinv(columns.T @ columns) * np.var(rest) * 10.0
        error = float(np.sqrt(max(spread[2, 2], 0.0)) / abs(gain))
        limit = 20.0 * dt
        lag += float(np.clip(part[1] / gain, -limit, limit))
        drift += float(np.clip(part[2] / gain, -0.02, 0.02))
        if abs(lag) > 2 * LAGS:
            break
    return gain, lag, drift, error, explained
