"""The noise of a sensor as it writes: its level, its colour, and the steps that it counts in.

Where nothing is stated, both level and colour are read from the upper half of the spectrum of what
the sensor wrote beyond the model, before any filter: there a motion has little left. Noise with a
memory is described by a first-order autoregression; it is looked for further down as long as the
spectrum goes on as the part above says, so that what a model lacks is not taken for noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy

STATED, ESTIMATED = "stated", "estimated"


@dataclass(frozen=True)
class ColumnNoise:
    """Of one column of a recording."""

    std: float
    """SI, of the part that is no step"""
    colour: float = 0.0
    """a in x(t) = a x(t - dt) + e(t), dt being the sensor's own sample time"""
    step: float = 0.0
    """Between the numbers that it can write, SI; 0 where they are continuous."""
    source: str = STATED
    after_logger: bool = False
    """Whether it comes after a logger's filter: what a narrow one let through nobody can tell from
    the motion, and what was added behind it is seen as it is."""

    def drawn(
        self, rng: np.random.Generator, column: np.ndarray, smooth: np.ndarray | None
    ) -> np.ndarray:
        """(N,) one draw of what the sensor adds; 0 where `column` has no sample.

        `smooth` (N,) is what it would read without noise: the error of a coarse encoder depends
        on how fast it moves.
        """
        out = np.zeros(len(column))
        sampled = np.isfinite(column)
        noise = self.std * coloured(rng, int(sampled.sum()), self.colour)
        if self.step:
            if smooth is None:
                noise = noise + self.step * rng.uniform(-0.5, 0.5, len(noise))
            else:
                true = smooth[sampled] + self.step * rng.uniform()
                noise = np.round((true + noise) / self.step) * self.step - true
        out[sampled] = noise
        return out


def coloured(rng: np.random.Generator, count: int, colour: float) -> np.ndarray:
    """(count,) of standard deviation one, stationary from the first sample on.

    White noise is scaled to that exactly, so that a floor without a filter is what was stated.
    """
    e = rng.standard_normal(count)
    if not colour or not count:
        return e / np.sqrt(np.mean(e**2)) if count else e
    own = np.sqrt(1.0 - colour**2) * e[1:]
    x, _ = scipy.signal.lfilter([1.0], [1.0, -colour], own, zi=[colour * e[0]])
    return np.concatenate([e[:1], x])


EVEN = 0.02
"""Of a step: how far distances may lie beside whole steps; files round at their last digit."""

FEWEST_LEVELS = 3
"""Levels between which a step shows."""


def step_of(column: np.ndarray) -> float:
    """The distance between the numbers that a column (N,) can hold; 0 where it has no such."""
    return common_step([column])


def common_step(columns: Sequence[np.ndarray]) -> float:
    """The same of one sensor's columns (N,) in several recordings, each counted from a zero of its
    own: a short or lively one alone may hold no two neighbouring counts."""
    levels = [np.unique(column[np.isfinite(column)]) for column in columns]
    levels = [each for each in levels if len(each) >= FEWEST_LEVELS]
    if not levels:
        return 0.0
    distances = np.concatenate([np.diff(each) for each in levels])
    step = float(distances.min())
    ratio = distances / step
    whole = np.abs(ratio - np.round(ratio)).max() < EVEN
    return step if whole and step > ROUNDING * max(np.abs(x).max() for x in levels) else 0.0


FEW_LEVELS = 8
"""An amplifier that is tried with levels has a handful; a converter's signal visits many."""


def is_command(column: np.ndarray) -> bool:
    """Whether a column (N,) is what a drive was told to hold, and no reading: most of its samples
    repeat the one before, and its few or uneven levels are no converter's.

    Its jumps are steep, and their spectrum would be taken for noise.
    """
    known = column[np.isfinite(column)]
    if len(known) < FEWEST or np.mean(np.diff(known) == 0.0) < 0.5:
        return False
    levels = len(np.unique(known))
    return 1 < levels <= FEW_LEVELS or (levels > 1 and step_of(known) == 0.0)


ROUNDING = 1e-12
"""Of the largest number: steps of floating point are no sensor's."""


DIFFERENCES = 3
"""Order of the differences that leave noise and take away what is smooth."""

NORMAL_MAD = 0.6744897501960817
"""Median of |x| for a standard normal x."""


def noise_of(error: np.ndarray) -> float:
    """Standard deviation of the white noise in one channel's unfiltered error (N,), robustly.

    The differences of order d of white noise have the variance binomial(2 d, d) times its own;
    the median is not moved by the few places where the motion itself jumps.
    """
    x = np.asarray(error)[np.isfinite(error)]
    if len(x) <= 2 * DIFFERENCES:
        return 0.0
    d = np.diff(x, DIFFERENCES)
    gain = np.sqrt(20.0)  # binomial(6, 3)
    return float(np.median(np.abs(d)) / NORMAL_MAD / gain)


class Spectrum(NamedTuple):
    """Periodogram ordinates, all above zero and below the Nyquist frequency."""

    angle: np.ndarray
    """rad per sample"""
    power: np.ndarray
    """Whose mean over all angles is the variance"""


FEWEST = 64
"""Samples of a piece from which a spectrum says something."""


def spectrum(pieces: Sequence[np.ndarray]) -> Spectrum:
    """Of some evenly sampled stretches (M,) of one column; none of them need be long."""
    angles, powers = [np.zeros(0)], [np.zeros(0)]
    for x in pieces:
        if len(x) < FEWEST:
            continue
        window = np.hanning(len(x))
        trend = np.polyval(np.polyfit(np.arange(len(x)), x, 1), np.arange(len(x)))
        power = np.abs(np.fft.rfft((x - trend) * window)) ** 2 / np.sum(window**2)
        angles.append(np.linspace(0.0, np.pi, len(power))[1:-1])
        powers.append(power[1:-1])
    angle, power = np.concatenate(angles), np.concatenate(powers)
    order = np.argsort(angle)
    return Spectrum(angle[order], power[order])


HIGH = (0.5 * np.pi, 0.95 * np.pi)
"""rad per sample: the band that is taken for the sensor's own at first. The last twentieth is left
out: what is differentiated or logged at twice the rate has nothing there."""

COLOURS = np.concatenate([[0.0], np.linspace(0.02, 0.98, 97)])
"""Tried one after the other: up to a memory of fifty samples."""

LINE = 6.0
"""Times the mean that the median around it stands for: one ordinate in four hundred of plain noise
is higher; lines are cut to that."""

CAUTION = 1.6
"""Times the power that was foretold: further down the spectrum is a model's error. Not much more
than what three standard deviations of a hundred ordinates are."""

STEP_DOWN = 2.0**-0.5
"""Of the lowest angle: each look goes half an octave further down."""

FEWEST_ORDINATES = 8
"""Of a spectrum, whose mean says something."""

QUIET = 4.0
"""Times the power of the quietest recording's high band, up to which another shows the sensor too:
twice the noise may come from the conditions. Beyond it stands motion that the model lacks."""


def quietest(pieces: Sequence[np.ndarray], step: float = 0.0) -> list[np.ndarray]:
    """Those of some stretches (M,) of one sensor's column that show it best: what a model misses
    only adds to the noise, and may do so in some recordings alone. `step`: of its counts."""
    levels = [_high_power(x) for x in pieces]
    known = [x for x in levels if np.isfinite(x) and x > 0.0]
    least = max(min(known, default=np.inf), step**2 / 12.0)
    return [x for x, level in zip(pieces, levels, strict=True) if not level > QUIET * least]


SURELY_LOUDER = 3.0
"""Standard deviations of a spectrum's mean power, beyond which a recording's noise is another."""


def noise_ratios(recordings: Sequence[Sequence[np.ndarray]]) -> np.ndarray:
    """How many times as large one sensor's noise is in each recording as in the quietest.

    Noise that is stated by a ratio to its signal, or a camera that stands elsewhere, is another in
    each recording. It is white or has the same colour there; what a model misses falls with
    frequency, and is no noise.

    Args:
        recordings: Even stretches (M,) of each.

    Returns:
        (recordings,), one where spectra show no difference.
    """
    found = np.ones(len(recordings))
    halves = [_powers_in_halves(pieces) for pieces in recordings]
    known = [i for i, (_, count) in enumerate(halves) if count.min() >= FEWEST_ORDINATES]
    if len(known) < 2:
        return found
    least, many = min((halves[i] for i in known), key=lambda half: half[0].mean())
    for i in known:
        power, count = halves[i]
        if not least.min() > 0.0 or not power.min() > 0.0:
            continue
        ratio, sure = np.log(power / least), SURELY_LOUDER * np.sqrt(1.0 / count + 1.0 / many)
        louder = ratio.mean() > np.sqrt(np.mean(sure**2) / 2.0)
        alike = abs(ratio[0] - ratio[1]) < np.sqrt(np.sum(sure**2))
        flat = abs(np.log(power[0] / power[1])) < SURELY_LOUDER * np.sqrt(np.sum(1.0 / count))
        if louder and (alike or flat):
            found[i] = np.exp(0.5 * ratio.mean())
    return found


def _powers_in_halves(pieces: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """(2,) mean power in the lower and the upper half of the high band, and how many ordinates."""
    s = without_lines(spectrum(pieces))
    ends = np.linspace(*HIGH, 3)
    halves = [(s.angle >= a) & (s.angle < b) for a, b in zip(ends[:-1], ends[1:], strict=True)]
    power = [float(np.mean(s.power[half])) if half.any() else 0.0 for half in halves]
    return np.array(power), np.array([half.sum() for half in halves])


def quieter(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """That of two series (M,) of one sensor which holds less of what is none of it."""
    return b if _high_power(b) < _high_power(a) else a


def _high_power(x: np.ndarray) -> float:
    """Mean power of a stretch (M,) in the high band; NaN where it is too short."""
    s = without_lines(spectrum([x]))
    chosen = (s.angle > HIGH[0]) & (s.angle < HIGH[1])
    return float(np.mean(s.power[chosen])) if chosen.sum() >= FEWEST_ORDINATES else np.nan


def estimated(pieces: Sequence[np.ndarray], angle_limit: float = np.pi) -> ColumnNoise | None:
    """Level and colour from what a column says beyond a model; None where too little is there.

    `angle_limit` (rad per sample): above it a logger's filter has left nothing.
    """
    s = without_lines(spectrum(pieces))
    low, high = _own_band(angle_limit)
    if np.sum((s.angle > low) & (s.angle < high)) < FEWEST_ORDINATES:
        return None
    colour, innovation = _fitted(s, low, high)
    while True:
        below = (s.angle > low * STEP_DOWN) & (s.angle <= low)
        if below.sum() < FEWEST_ORDINATES:
            break
        ratio = float(np.mean(s.power[below] * _shape(colour, s.angle[below])) / innovation)
        band = CAUTION + 3.0 / np.sqrt(below.sum())
        if not 1.0 / band < ratio < band:
            break
        low *= STEP_DOWN
        colour, innovation = _fitted(s, low, high)
    return ColumnNoise(float(np.sqrt(innovation / (1.0 - colour**2))), colour, source=ESTIMATED)


def with_colour(
    stated: ColumnNoise, pieces: Sequence[np.ndarray], angle_limit: float = np.pi
) -> ColumnNoise:
    """The stated level with the colour that the upper half of the spectrum shows."""
    s = without_lines(spectrum(pieces))
    low, high = _own_band(angle_limit)
    chosen = (s.angle > low) & (s.angle < high)
    variance = stated.std**2 + stated.step**2 / 12.0
    if chosen.sum() < FEWEST_ORDINATES or not variance:
        return stated
    angle, power = s.angle[chosen], s.power[chosen]
    ratios = [(1.0 - a * a) * variance / _shape(a, angle) for a in COLOURS]
    misfits = [float(np.sum(np.log(level) + power / level)) for level in ratios]
    white = len(power) * (np.log(np.mean(power)) + 1.0)
    best = int(np.argmin(misfits))
    # A sensor that is better than stated has a flat spectrum at a lower level, not a memory.
    return replace(stated, colour=float(COLOURS[best])) if misfits[best] < white - SURE else stated


SURE = 2.0
"""By which a colour must explain a spectrum better than a shorter memory, in units of the logarithm
of the likelihood: two standard deviations."""


def _own_band(angle_limit: float) -> tuple[float, float]:
    """rad per sample: where a sensor's noise stands alone at first."""
    share = min(angle_limit / np.pi, 1.0)
    return HIGH[0] * share, HIGH[1] * share


def without_lines(s: Spectrum) -> Spectrum:
    """Ordinates cut to LINE times the mean around them, which is the median over log 2."""
    if len(s.power) < FEWEST_ORDINATES:
        return s
    width = max(min(101, 2 * (len(s.power) // 8) + 1), 3)
    padded = np.pad(s.power, width // 2, mode="reflect")
    median = np.median(np.lib.stride_tricks.sliding_window_view(padded, width), axis=1)
    return Spectrum(s.angle, np.minimum(s.power, LINE * median / np.log(2.0)))


def _shape(colour: float, angle: np.ndarray) -> np.ndarray:
    """One over the spectrum of an autoregression with an innovation of one."""
    return np.asarray(1.0 + colour**2 - 2.0 * colour * np.cos(angle))


def _fitted(s: Spectrum, low: float, high: float) -> tuple[float, float]:
    """Colour and innovation's variance by Whittle's likelihood between two angles.

    The shortest memory that the spectrum does not contradict: of a longer one only the slope can be
    seen there, and how far it rises below is anybody's guess.
    """
    chosen = (s.angle > low) & (s.angle < high)
    angle, power = s.angle[chosen], s.power[chosen]
    shapes = [_shape(colour, angle) for colour in COLOURS]
    innovations = [max(float(np.mean(power * shape)), 1e-300) for shape in shapes]
    misfits = [
        len(power) * float(np.log(innovation) - np.mean(np.log(shape)))
        for innovation, shape in zip(innovations, shapes, strict=True)
    ]
    likely = np.flatnonzero(np.array(misfits) < min(misfits) + SURE)
    return float(COLOURS[likely[0]]), innovations[likely[0]]
