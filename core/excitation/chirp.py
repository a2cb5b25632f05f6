"""Sines whose frequency rises."""

from typing import ClassVar

import numpy as np
import scipy

from core.excitation.excitation import Excitation, Positive


class Chirp(Excitation):
    """A logarithmic chirp per joint, one upwards, the next downwards in frequency."""

    kind: ClassVar[str] = "chirp"

    lowest_hz: Positive = 0.5
    """Hz"""
    highest_hz: Positive = 50.0
    """Hz"""

    def signal(self, samples: int, joints: int, dt: float, rng: np.random.Generator) -> np.ndarray:
        t = np.arange(samples) * dt
        ends = (self.lowest_hz, self.highest_hz)
        columns = []
        for k in range(joints):
            first, last = ends if k % 2 == 0 else ends[::-1]
            phase = rng.uniform(0.0, 360.0)
            columns.append(
                scipy.signal.chirp(t, first, t[-1], last, method="logarithmic", phi=phase)
            )
        return self.amplitude * np.column_stack(columns)
