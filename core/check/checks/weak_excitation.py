"""A motion too small for what is to be estimated."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from core.check.case import Case
from core.check.finding import Check, Finding
from core.check.measured import noise_of

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
            noise = noise_of(q)
            moved = float(np.std(q))
            if noise > 0 and moved < FEWEST * noise:
                said = f"{name} moves by {moved:.3g} rms, {moved / noise:.2g} times its noise"
                yield case.finding(self.kind, name, moved / noise, "", said)
