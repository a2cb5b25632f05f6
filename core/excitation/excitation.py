"""The contract of an excitation, and the common kinds."""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
import scipy
from pydantic import Field

from ..errors import InputError
from ..validation import Positive, Stated


class Excitation(Stated):
    """A signal per joint, seeded, uncorrelated between joints."""

    kind: ClassVar[str] = ""
    amplitude: Positive = 0.3
    """rad/s for velocity loops; the unit of the reference otherwise."""
    hold: Positive = 0.02
    """s, how long a level is kept."""

    def signal(self, samples: int, joints: int, dt: float, rng: np.random.Generator) -> np.ndarray:
        """(samples, joints), `dt` s apart, within the amplitude and in its unit."""
        raise NotImplementedError

    def hold_samples(self, dt: float) -> int:
        """Samples per hold at a sample time dt in s; one at least."""
        return max(int(round(self.hold / dt)), 1)


class Prbs(Excitation):
    """Plus or minus the amplitude, drawn again after each hold; theta2 drifts with it."""

    kind: ClassVar[str] = "prbs"

    def signal(self, samples: int, joints: int, dt: float, rng: np.random.Generator) -> np.ndarray:
        hold = self.hold_samples(dt)
        levels = rng.choice([-self.amplitude, self.amplitude], (-(-samples // hold), joints))
        return np.repeat(levels, hold, axis=0)[:samples]


class BalancedPrbs(Excitation):
    """A PRBS whose every hold is followed by its negative: no net displacement, so the arm
    stays at its working point (the default)."""

    kind: ClassVar[str] = "prbs_balanced"

    def signal(self, samples: int, joints: int, dt: float, rng: np.random.Generator) -> np.ndarray:
        hold = self.hold_samples(dt)
        levels = rng.choice([-self.amplitude, self.amplitude], (-(-samples // (2 * hold)), joints))
        paired = np.stack([levels, -levels], axis=1).reshape(-1, joints)
        return np.repeat(paired, hold, axis=0)[:samples]


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
                f"per period; use fewer periods or more seconds."
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
