"""The contract of an excitation."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from core.validation import Positive, Stated


class Excitation(Stated):
    """A signal per joint, seeded, uncorrelated between joints."""

    kind: ClassVar[str] = ""
    amplitude: Positive = 0.3
    """rad/s for velocity loops; the unit of the reference otherwise."""
    hold: Positive = 0.02
    """s, how long a level is kept."""

    def signal(self, samples: int, joints: int, dt: float, rng: np.random.Generator) -> np.ndarray:
        """(samples, joints)"""
        raise NotImplementedError

    def hold_samples(self, dt: float) -> int:
        """Samples per hold at a sample time dt in s; one at least."""
        return max(int(round(self.hold / dt)), 1)
