"""An experiment that repeats itself: good, it gives the noise floor."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from core.check.case import Case
from core.check.finding import Check, Finding

ALIKE = 1e-3
"""Of the reference's spread: the command itself repeats exactly, but for rounding."""
FEWEST = 2


class RepeatedCycles(Check):
    """References that are the same again after a period."""

    kind = "repeated_cycles"

    def look(self, case: Case) -> Iterable[Finding]:
        found = case.recording
        names = found.names("theta#_ref", "dtheta#_ref")
        if not names:
            return
        signals = np.column_stack([found.even(n) for n in names])
        period = _period(signals)
        if period:
            span, count = period * found.step, len(signals) // period
            said = (
                f"the references repeat every {span:.4g} s, {count} times: their scatter is noise"
            )
            yield case.finding(self.kind, names[0], span, "s", said)


def _period(x: np.ndarray) -> int:
    """Rows after which all columns repeat to the end, at least FEWEST times; 0: never."""
    n = len(x)
    x = x[:, np.ptp(x, axis=0) > 0]
    if x.shape[1] == 0 or n < 40:
        return 0
    centred = x - x.mean(axis=0)
    power = np.sum(np.abs(np.fft.rfft(centred, 2 * n, axis=0)) ** 2, axis=1)
    likeness = np.fft.irfft(power)[:n] / (np.arange(n, 0, -1) / n)
    likeness = likeness / likeness[0]
    top = n // FEWEST
    inner = range(10, min(top + 1, n - 1))
    high = [k for k in inner if likeness[k] > 0.9]
    peaks = [k for k in high if likeness[k] >= max(likeness[k - 1], likeness[k + 1])]
    for k in peaks:
        apart = np.sqrt(np.mean((x[k:] - x[:-k]) ** 2, axis=0))
        moved = np.sqrt(np.mean(centred**2, axis=0))
        if np.all(apart <= ALIKE * moved):
            return int(k)
    return 0
