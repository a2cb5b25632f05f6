"""A motion too small for what is to be estimated."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from core.check.case import Case
from core.check.checks.outliers import far_out
from core.check.finding import Check, Finding
from core.check.measured import noise_of
from core.recording.visible_band import spectrum

FEWEST = 10.0
"""Times its noise must a joint move: with less, 10 % of what is estimated is noise."""


class WeakExcitation(Check):
    """Joints that hardly move more than their noise."""

    kind = "weak_excitation"

    def look(self, case: Case) -> Iterable[Finding]:
        found = case.recording
        for name in found.names("theta#"):
            q = found.counted(name)
            q = q[np.isfinite(q)]
            q = q[~far_out(q)]  # outliers are another fault, and look like noise
            noise = quiet_noise(q, found.step)
            moved = float(np.std(q))
            if noise > 0 and moved < FEWEST * noise:
                sentence = f"{name} moves by {moved:.3g} rms, {moved / noise:.2g} times its noise"
                yield case.finding(self.kind, name, moved / noise, "", sentence)


def quiet_noise(x: np.ndarray, dt: float) -> float:
    """Standard deviation of white noise in x (N,), where it is least among high frequencies: a
    lively motion reaches up to half the sample rate, but not evenly."""
    seen = spectrum(x, dt)
    return noise_of(x) if seen is None else float(np.sqrt(seen.noise))
