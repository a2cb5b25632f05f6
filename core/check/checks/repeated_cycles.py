"""An experiment that repeats itself: good, it gives the noise floor."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from ...check.case import Case
from ...check.finding import Check, Finding
from ...check.measured_recording import lattice_step, noise_of

ALIKE = 1e-3
"""Of the reference's spread: the command itself repeats exactly, but for rounding."""
NOISE = 2.0
"""Times a channel's noise; the difference of two noisy copies has 1.4 times that."""
MOST = 0.05
"""Of the spread: what looks like more noise, or like coarser rounding, is the command itself."""
APART = 0.5
"""Of the spread, by which a signal leaves its beginning before it can be said to return."""
FEWEST = 2
"""Cycles, of which one can differ."""


class RepeatedCycles(Check):
    """References that are the same again after a period."""

    kind = "repeated_cycles"

    def find(self, case: Case) -> Iterable[Finding]:
        recording = case.recording
        names = recording.names("theta#_ref", "dtheta#_ref")
        if not names:
            return
        signals = np.column_stack([recording.even(n) for n in names])
        period = _period(signals)
        if period:
            span, count = period * recording.step, len(signals) // period
            sentence = (
                f"the references repeat every {span:.4g} s, {count} times: their scatter is noise"
            )
            cycles = case.finding(self.kind, names[0], span, "s", sentence)
            yield replace(cycles, is_fault=False)


def _period(x: np.ndarray) -> int:
    """Rows after which all columns repeat to the end, at least FEWEST times; 0: never."""
    x = x[:, np.ptp(x, axis=0) > 0]
    if x.shape[1] == 0 or len(x) < 40:
        return 0
    spread = np.std(x, axis=0)
    difference = _apart(x)[: len(x) // FEWEST + 1] / spread
    tolerance = np.array([_tolerance(each) for each in x.T]) / spread
    departed = np.flatnonzero(np.any(difference > APART, axis=1))
    returned = np.flatnonzero(np.all(difference <= tolerance, axis=1))
    returned = returned[returned > departed[0]] if departed.size else departed
    if not returned.size:
        return 0
    # The first lags that are as good as each other: noise decides which of them is the first.
    near = returned[: int(np.argmax(np.diff(returned, append=len(x)) > 1)) + 1]
    return int(near[np.argmin(np.sum(difference[near] ** 2, axis=1))])


def _apart(x: np.ndarray) -> np.ndarray:
    """(N, columns) rms difference of each column and itself k rows later, k = 0 to N - 1."""
    n = len(x)
    x = x - x.mean(axis=0)
    power = np.abs(np.fft.rfft(x, 2 * n, axis=0)) ** 2
    products = np.fft.irfft(power, axis=0)[:n]
    squares = np.cumsum(x**2, axis=0)
    both = squares[::-1] + squares[-1] - np.vstack([np.zeros(x.shape[1]), squares[:-1]])
    rows = np.arange(n, 0, -1)[:, None]
    return np.sqrt(np.maximum(both - 2.0 * products, 0.0) / rows)


def _tolerance(x: np.ndarray) -> float:
    """By how much (rms) two copies of a command (N,) differ: by its noise or its rounding."""
    spread, step = float(np.std(x)), lattice_step(x)
    rounding = step if step <= MOST * spread else 0.0
    return max(ALIKE * spread, min(NOISE * noise_of(x), MOST * spread), rounding)
