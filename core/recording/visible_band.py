"""The band of frequencies in which recorded places show a motion, and not their own noise.

A torque along a recorded motion needs the second derivative of what an encoder says. There white
noise grows with the square of the frequency, and at a thousand samples per second it is all that is
left. So, as the field does (Gautier 1997; Janot, Vandanjon & Gautier 2014), a torque is compared
within the band of the motion. Here the band is read from the places themselves: a motion falls
steeply with frequency, noise does not, and the band ends where the one drowns in the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

ABOVE = 4.0
"""Times the noise's power that a motion has within the band: twice its amplitude."""

TOP = (0.25, 0.5, 0.95)
"""Of half the sampling rate: the two octaves at the top; noise stands alone in one of them."""

FALLING = 5.0
"""Times the level of the uppermost octave that the one below has where it is a motion still and no
noise: a white acceleration falls by seven."""

BAND_RATIO = 1.06
"""From an end of a band of frequencies to the other: a twelfth of an octave."""

FEWEST = 6
"""Ordinates of a periodogram in a band, whose mean is then good to two fifths."""

SHORTEST = 256
"""Samples of which a spectrum separates the motion from the noise."""


class VisibleBand(NamedTuple):
    """What is seen of one column."""

    hz: float
    """Where it ends"""
    noise: float
    """Standard deviation of white noise, in the column's unit"""
    whole: bool
    """Whether a motion fills the two octaves at the top, so that no noise stands there alone."""


class _Spectrum(NamedTuple):
    hz: np.ndarray
    """(B,), the upper ends of bands"""
    ordinates: np.ndarray
    """(B,) how many are in each"""
    power: np.ndarray
    """(B,) mean power; of white noise its variance"""
    rate: float
    """Hz, of the samples"""

    @property
    def levels(self) -> list[float]:
        """Median power in the two octaves at the top."""
        ends = [0.5 * share * self.rate for share in TOP]
        inside = [(self.hz >= a) & (self.hz < b) for a, b in zip(ends[:-1], ends[1:], strict=True)]
        return [float(np.median(self.power[where])) for where in inside if where.any()]

    @property
    def noise(self) -> float:
        """Variance of white noise: the lower one of these levels."""
        return max(min(self.levels), 1e-300)

    @property
    def falling(self) -> float:
        """By how much the upper one is lower."""
        return self.levels[0] / self.noise


def visible_band(columns: Sequence[tuple[np.ndarray, float]]) -> VisibleBand | None:
    """The band of one joint in all recordings together, from its places (N,), rad or m, and the
    sample time (s) of each. None where the recordings are too short, or the joint stands still."""
    spectra = [s for x, dt in columns if (s := _spectrum(x, dt)) is not None]
    if not spectra:
        return None
    noises = [s.noise for s in spectra]
    hz = np.concatenate([s.hz for s in spectra])
    evidence = np.concatenate([
        s.ordinates * np.log(np.maximum(s.power / (ABOVE * noise), 1e-3))
        for s, noise in zip(spectra, noises, strict=True)
    ])  # fmt: skip
    order = np.argsort(hz)
    # The likeliest place of a step between two levels; a line beyond it moves it by little.
    gained = np.cumsum(evidence[order])
    best = int(np.argmax(gained))
    if gained[best] <= 0.0:
        return None
    end = float(hz[order][best])
    falling = float(np.median([s.falling for s in spectra])) > FALLING
    return VisibleBand(end, float(np.sqrt(np.mean(noises))), falling)


def _spectrum(x: np.ndarray, dt: float) -> _Spectrum | None:
    """Of places x (N,), from their second differences: a window leaks little of these."""
    if len(x) < SHORTEST or not np.isfinite(x).all() or not np.ptp(x):
        return None
    change = np.diff(x, 2)
    window = np.hanning(len(change))
    power = np.abs(np.fft.rfft((change - change.mean()) * window)) ** 2 / np.sum(window**2)
    angle = np.linspace(0.0, np.pi, len(power))[1:]
    power = power[1:] / (2.0 - 2.0 * np.cos(angle)) ** 2
    ends = [0]
    while ends[-1] < len(power):
        ends.append(min(max(ends[-1] + FEWEST, int(ends[-1] * BAND_RATIO) + 1), len(power)))
    count = np.diff(ends)
    mean = np.add.reduceat(power, ends[:-1]) / count
    upper = angle[np.array(ends[1:]) - 1]
    return _Spectrum(upper / (2.0 * np.pi * dt), count, mean, 1.0 / dt)
