"""A sensor with too coarse steps."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...check.case import Case
from ...check.finding import Check, Finding
from ...check.measured_recording import lattice_step
from ...recording.channels import is_reference

COARSE = 0.05
"""Of the channel's spread: three times the coarsest current sensor of real recordings (0.0155)."""


class Quantised(Check):
    """Values on a lattice whose step is a large share of the motion."""

    kind = "quantised"

    def find(self, case: Case) -> Iterable[Finding]:
        recording = case.recording
        for name in recording.channels:
            if is_reference(name):
                continue
            x = recording.counted(name)
            x = x[np.isfinite(x)]
            step = lattice_step(x)
            if step > COARSE * float(np.std(x)):
                share = step / float(np.std(x))
                sentence = f"{name} has steps of {step:.4g}, {share:.0%} of its standard deviation"
                yield case.finding(self.kind, name, step, "SI", sentence)
