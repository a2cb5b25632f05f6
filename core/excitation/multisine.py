"""Multisines with repeated periods, from which the noise can be told."""

from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from core.errors import InputError
from core.excitation.excitation import Excitation, Positive


class Multisine(Excitation):
    """Random-phase sines up to `highest_hz`, `periods` times; joints take turns in frequency."""

    kind: ClassVar[str] = "multisine"

    highest_hz: Positive = 50.0
    """Hz"""
    periods: Annotated[int, Field(ge=1)] = 3
    """How often the signal repeats."""

    def signal(self, samples: int, joints: int, dt: float, rng: np.random.Generator) -> np.ndarray:
        period = samples // self.periods
        if period // 2 - 1 < joints:
            raise InputError(
                f"simulate.options of multisine: periods = {self.periods} leaves {period} samples "
                f"for each of them; use fewer periods or more seconds."
            )
        out = np.zeros((period, joints))
        highest = min(int(self.highest_hz * period * dt), period // 2 - 1)
        for k in range(joints):
            lines = np.arange(1 + k, max(highest, joints) + 1, joints)
            spectrum = np.zeros(period // 2 + 1, dtype=complex)
            spectrum[lines] = np.exp(1j * rng.uniform(0.0, 2.0 * np.pi, len(lines)))
            wave = np.fft.irfft(spectrum, period)
            out[:, k] = self.amplitude * wave / np.abs(wave).max()
        repeats = -(-samples // period)
        return np.tile(out, (repeats, 1))[:samples]
