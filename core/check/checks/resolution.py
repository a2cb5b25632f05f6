"""Motion too small, or steps too coarse, for what is to be estimated."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...check.case import Case
from ...check.finding import Check, Finding
from ...check.signals import far_out, lattice_step, quiet_noise
from ...noise.sensor_noise import noise_of
from ...recording.channels import is_reference

LEAST_MOTION_OVER_NOISE = 10.0
"""Times its noise must a joint move: with less, 10 % of what is estimated is noise."""


class WeakExcitation(Check):
    """Joints that hardly move more than their noise."""

    kind = "weak_excitation"

    def find(self, case: Case) -> Iterable[Finding]:
        recording = case.recording
        for name in recording.names("theta#"):
            q = recording.counted(name)
            q = q[np.isfinite(q)]
            q = q[~far_out(q)]  # outliers are another fault, and look like noise
            moved = float(np.std(q))
            if 0.0 < 2.0 * LEAST_MOTION_OVER_NOISE * noise_of(q) < moved:
                continue  # the noise without the motion's own fast part is no larger
            noise = quiet_noise(q)
            if noise > 0 and moved < LEAST_MOTION_OVER_NOISE * noise:
                sentence = f"{name} moves by {moved:.3g} rms, {moved / noise:.2g} times its noise"
                yield case.finding(self.kind, name, moved / noise, "", sentence)


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
