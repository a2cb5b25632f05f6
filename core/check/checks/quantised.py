"""A sensor with too coarse steps."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from core.check.case import Case
from core.check.finding import Check, Finding

COARSE = 0.05
"""Of the channel's spread: three times the coarsest current sensor of real recordings (0.0155)."""
ON_LATTICE = 0.1
"""Of a step, the rms distance from whole numbers of steps."""
FEWEST = 3


class Quantised(Check):
    """Values on a lattice whose step is a large share of the motion."""

    kind = "quantised"

    def look(self, case: Case) -> Iterable[Finding]:
        found = case.recording
        for name in found.channels:
            if name.endswith("_ref"):
                continue
            x = found.counted(name)
            x = x[np.isfinite(x)]
            levels = np.unique(x)
            if len(levels) < FEWEST or len(levels) > len(x) / 5:
                continue
            gaps = np.diff(levels)
            step = float(np.median(gaps[gaps > 1e-9 * np.ptp(x)]))
            whole = (levels - levels[0]) / step
            off = float(np.sqrt(np.mean((whole - np.round(whole)) ** 2)))
            if off < ON_LATTICE and step > COARSE * float(np.std(x)):
                share = step / float(np.std(x))
                said = f"{name} has steps of {step:.4g}, {share:.0%} of its standard deviation"
                yield case.finding(self.kind, name, step, "SI", said)
