"""Pseudo-random binary signals."""

from typing import ClassVar

import numpy as np

from core.excitation.excitation import Excitation


class Prbs(Excitation):
    """Plus or minus the amplitude, drawn anew after each hold; theta2 wanders with it."""

    kind: ClassVar[str] = "prbs"

    def signal(self, samples: int, joints: int, dt: float, rng: np.random.Generator) -> np.ndarray:
        held = self.hold_samples(dt)
        levels = rng.choice([-self.amplitude, self.amplitude], (-(-samples // held), joints))
        return np.repeat(levels, held, axis=0)[:samples]


class BalancedPrbs(Excitation):
    """A PRBS whose every hold is followed by its negative: no net displacement, so the arm
    stays at its working point (the default)."""

    kind: ClassVar[str] = "prbs_balanced"

    def signal(self, samples: int, joints: int, dt: float, rng: np.random.Generator) -> np.ndarray:
        held = self.hold_samples(dt)
        levels = rng.choice([-self.amplitude, self.amplitude], (-(-samples // (2 * held)), joints))
        paired = np.stack([levels, -levels], axis=1).reshape(-1, joints)
        return np.repeat(paired, held, axis=0)[:samples]
