"""Noise of a sensor: level, autocorrelation, and quantisation step.

If nothing is stated, level and autocorrelation are read from the upper half of the residual's
spectrum, before any filter: a motion has little there. Correlated noise is a first-order
autoregression, by Whittle's likelihood (1953). Lower frequencies are used as long as they continue
the spectrum above, so that model errors do not count as noise.
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
    """Noise of one column of a recording."""

    std: float
    """SI, without quantisation"""
    ar_coefficient: float = 0.0
    """a in x(t) = a x(t - dt) + e(t), with dt the sensor's sample time"""
    quantum: float = 0.0
    """Quantisation step, SI; 0: continuous."""
    source: str = STATED
    after_logger: bool = False
    """Whether the noise is added after a logger's filter. Nobody can distinguish noise before a
    narrow one from the motion."""

    def drawn(
        self, rng: np.random.Generator, column: np.ndarray, smooth: np.ndarray | None
    ) -> np.ndarray:
        """(N,) one draw of the noise; 0 where `column` (N,) has no sample.

        `smooth` (N,) is the noise-free reading: the error of a coarse encoder depends on its speed.
        """
        out = np.zeros(len(column))
        sampled = np.isfinite(column)
        noise = self.std * autoregressive_noise(rng, int(sampled.sum()), self.ar_coefficient)
        if self.quantum:
            if smooth is None:
                noise = noise + self.quantum * rng.uniform(-0.5, 0.5, len(noise))
            else:
                true = smooth[sampled] + self.quantum * rng.uniform()
                noise = np.round((true + noise) / self.quantum) * self.quantum - true
        out[sampled] = noise
        return out


def autoregressive_noise(rng: np.random.Generator, count: int, coefficient: float) -> np.ndarray:
    """(count,) autoregressive noise of standard deviation one, stationary from the first sample on;
    `coefficient`: correlation with the sample before. White noise is scaled to exactly one, so that
    an unfiltered noise floor equals the stated one."""
    e = rng.standard_normal(count)
    if not coefficient or not count:
        return e / np.sqrt(np.mean(e**2)) if count else e
    own = np.sqrt(1.0 - coefficient**2) * e[1:]
    x, _ = scipy.signal.lfilter([1.0], [1.0, -coefficient], own, zi=[coefficient * e[0]])
    return np.concatenate([e[:1], x])


STEP_TOLERANCE = 0.02
"""Of a step: largest deviation of a distance from whole steps; files round their last digit."""

FEWEST_LEVELS = 3
"""Levels needed to find a step."""


def common_quantisation_step(columns: Sequence[np.ndarray]) -> float:
    """The quantisation step, in the unit of the sensor's columns (N,), of several recordings, each
    with its own zero: a single one may hold no two neighbouring counts; 0: none."""
    levels = [np.unique(column[np.isfinite(column)]) for column in columns]
    levels = [each for each in levels if len(each) >= FEWEST_LEVELS]
    if not levels:
        return 0.0
    distances = np.concatenate([np.diff(each) for each in levels])
    step = float(distances.min())
    ratio = distances / step
    whole = np.abs(ratio - np.round(ratio)).max() < STEP_TOLERANCE
    return step if whole and step > ROUNDING * max(np.abs(x).max() for x in levels) else 0.0


FEW_LEVELS = 8
"""Most levels of a commanded test signal; a converter's signal has many more."""


def is_command(column: np.ndarray) -> bool:
    """Whether a column (N,) is a command and no reading: most samples repeat the one before, and
    its levels are few or uneven. The spectrum of its jumps would count as noise."""
    values = column[np.isfinite(column)]
    if len(values) < FEWEST_IN_SPECTRUM or np.mean(np.diff(values) == 0.0) < 0.5:
        return False
    levels = len(np.unique(values))
    return 1 < levels <= FEW_LEVELS or (levels > 1 and common_quantisation_step([values]) == 0.0)


ROUNDING = 1e-12
"""Of the largest number: smaller steps are floating-point rounding."""


DIFFERENCES = 3
"""Order of the differences that keep noise and remove smooth signals."""

NORMAL_MAD = float(scipy.stats.norm.ppf(0.75))
"""Median of |x| for a standard normal x."""


def noise_of(error: np.ndarray) -> float:
    """Robust standard deviation of white noise in one channel's unfiltered error (N,).

    Differences of order d of white noise have binomial(2 d, d) times its variance; the median
    ignores the few places where the motion jumps.
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


FEWEST_IN_SPECTRUM = 64
"""Fewest samples of a stretch for a spectrum."""


def spectrum(pieces: Sequence[np.ndarray]) -> Spectrum:
    """The spectrum of evenly sampled stretches (M,) of one column; none need be long."""
    angles, powers = [np.zeros(0)], [np.zeros(0)]
    for x in pieces:
        if len(x) < FEWEST_IN_SPECTRUM:
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
"""rad per sample: band of the sensor's own noise. The last twentieth is left out: differentiated or
resampled signals have nothing there."""

AR_COEFFICIENTS = np.concatenate([[0.0], np.linspace(0.02, 0.98, 97)])
"""Coefficients that are tried: up to a memory of fifty samples."""

LINE_CUT = 6.0
"""Ordinates are cut to this multiple of the local mean (from the median); one in four hundred of
white noise is higher."""

MOST_POWER_RATIO = 1.6
"""Largest ratio to the predicted power; above it, the lower frequencies hold model error. Little
more than three standard deviations of a hundred ordinates."""

STEP_DOWN = float(np.sqrt(0.5))
"""Factor on the lowest angle: each step goes half an octave down."""

FEWEST_ORDINATES = 8
"""Fewest ordinates for a mean power."""

MOST_QUIET_POWER = 4.0
"""Largest ratio to the high-band power of the quietest recording. Conditions may double the noise;
above that stands motion that the model lacks."""


def quietest_stretches(pieces: Sequence[np.ndarray], quantum: float = 0.0) -> list[np.ndarray]:
    """The stretches (M,) that show the sensor's noise best: model error only adds to it, in some
    recordings. `quantum`: quantisation step, in their unit."""
    levels = [_high_power(x) for x in pieces]
    positive = [x for x in levels if np.isfinite(x) and x > 0.0]
    least = max(min(positive, default=np.inf), quantum**2 / 12.0)
    return [
        x for x, level in zip(pieces, levels, strict=True) if not level > MOST_QUIET_POWER * least
    ]


LOUDER_SIGNIFICANCE = 0.003
"""Probability that any of several recordings with the same noise seems louder than the quietest."""


def noise_ratios(recordings: Sequence[Sequence[np.ndarray]]) -> np.ndarray:
    """(R,) the noise of one sensor in each of R recordings over that in the quietest.

    Noise stated relative to the signal, or a moved camera, differs by recording. It is white or has
    the same spectrum; model error falls with frequency and does not count.
    """
    ratios = np.ones(len(recordings))
    halves = [_half_band_powers(pieces) for pieces in recordings]
    usable = [i for i, (_, count) in enumerate(halves) if count.min() >= FEWEST_ORDINATES]
    if len(usable) < 2:
        return ratios
    least, many = min((halves[i] for i in usable), key=lambda half: half[0].mean())
    pairs = len(usable) * (len(usable) - 1)
    deviations = -float(scipy.special.ndtri(LOUDER_SIGNIFICANCE / pairs))
    for i in usable:
        power, count = halves[i]
        if not least.min() > 0.0 or not power.min() > 0.0:
            continue
        ratio, sure = np.log(power / least), deviations * np.sqrt(1.0 / count + 1.0 / many)
        louder = ratio.mean() > np.sqrt(np.mean(sure**2) / 2.0)
        similar = abs(ratio[0] - ratio[1]) < np.sqrt(np.sum(sure**2))
        flat = abs(np.log(power[0] / power[1])) < deviations * np.sqrt(np.sum(1.0 / count))
        if louder and (similar or flat):
            ratios[i] = np.exp(0.5 * ratio.mean())
    return ratios


def _half_band_powers(pieces: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """(2,) mean power in the lower and upper half of the high band, and the number of independent
    ordinates: half of a Hann window's."""
    s = without_lines(spectrum(pieces))
    ends = np.linspace(*HIGH, 3)
    halves = [(s.angle >= a) & (s.angle < b) for a, b in zip(ends[:-1], ends[1:], strict=True)]
    power = [float(np.mean(s.power[half])) if half.any() else 0.0 for half in halves]
    return np.array(power), np.array([half.sum() // 2 for half in halves])


def quieter_of(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The one of two series a (M,) and b (M,) with less power in the high band."""
    return b if _high_power(b) < _high_power(a) else a


def _high_power(x: np.ndarray) -> float:
    """Mean power of a stretch (M,) in the high band; NaN where it is too short."""
    s = without_lines(spectrum([x]))
    chosen = (s.angle > HIGH[0]) & (s.angle < HIGH[1])
    return float(np.mean(s.power[chosen])) if chosen.sum() >= FEWEST_ORDINATES else np.nan


def estimate_noise(pieces: Sequence[np.ndarray], angle_limit: float = np.pi) -> ColumnNoise | None:
    """Level and autocorrelation of a column's residual; None if there is too little data.
    `angle_limit` (rad per sample): a logger's filter leaves nothing above it."""
    s = without_lines(spectrum(pieces))
    low, high = _sensor_band(angle_limit)
    if np.sum((s.angle > low) & (s.angle < high)) < FEWEST_ORDINATES:
        return None
    coefficient, innovation = _fit_spectrum(s, low, high)
    while True:
        below = (s.angle > low * STEP_DOWN) & (s.angle <= low)
        if below.sum() < FEWEST_ORDINATES:
            break
        ratio = float(
            np.mean(s.power[below] * _inverse_spectrum(coefficient, np.cos(s.angle[below])))
            / innovation
        )
        band = MOST_POWER_RATIO + 3.0 / np.sqrt(below.sum())
        if not 1.0 / band < ratio < band:
            break
        low *= STEP_DOWN
        coefficient, innovation = _fit_spectrum(s, low, high)
    return ColumnNoise(
        float(np.sqrt(innovation / (1.0 - coefficient**2))), coefficient, source=ESTIMATED
    )


def with_ar_coefficient(
    stated: ColumnNoise, pieces: Sequence[np.ndarray], angle_limit: float = np.pi
) -> ColumnNoise:
    """The stated noise with the autocorrelation of the upper half of the spectrum, which ends at
    `angle_limit` (rad per sample)."""
    s = without_lines(spectrum(pieces))
    low, high = _sensor_band(angle_limit)
    chosen = (s.angle > low) & (s.angle < high)
    variance = stated.std**2 + stated.quantum**2 / 12.0
    if chosen.sum() < FEWEST_ORDINATES or not variance:
        return stated
    angle, power = s.angle[chosen], s.power[chosen]
    cosine = np.cos(angle)
    ratios = [(1.0 - a * a) * variance / _inverse_spectrum(a, cosine) for a in AR_COEFFICIENTS]
    misfits = [float(np.sum(np.log(level) + power / level)) for level in ratios]
    white = len(power) * (np.log(np.mean(power)) + 1.0)
    best = int(np.argmin(misfits))
    # A sensor that is better than stated has a flat spectrum at a lower level, not a memory.
    if misfits[best] < white - LIKELIHOOD_MARGIN:
        return replace(stated, ar_coefficient=float(AR_COEFFICIENTS[best]))
    return stated


LIKELIHOOD_MARGIN = 2.0
"""Log-likelihood by which a longer memory must be better: two standard deviations."""


def _sensor_band(angle_limit: float) -> tuple[float, float]:
    """rad per sample: band of the sensor's noise alone."""
    share = min(angle_limit / np.pi, 1.0)
    return HIGH[0] * share, HIGH[1] * share


def without_lines(s: Spectrum) -> Spectrum:
    """Ordinates cut to LINE_CUT times the local mean, which is the median over log 2."""
    if len(s.power) < FEWEST_ORDINATES:
        return s
    width = max(min(101, 2 * (len(s.power) // 8) + 1), 3)
    median = scipy.ndimage.median_filter(s.power, size=width, mode="mirror")
    return Spectrum(s.angle, np.minimum(s.power, LINE_CUT * median / np.log(2.0)))


def _inverse_spectrum(coefficient: float, cosine: np.ndarray) -> np.ndarray:
    """Inverse spectrum of an autoregression with unit innovation, at the cosines of the angles."""
    return np.asarray((1.0 + coefficient**2) - 2.0 * coefficient * cosine)


def _fit_spectrum(s: Spectrum, low: float, high: float) -> tuple[float, float]:
    """Coefficient and innovation variance by Whittle's likelihood between two angles.

    The shortest memory that the spectrum does not contradict: of a longer one only the slope is
    visible here, and its low frequencies are unknown.
    """
    chosen = (s.angle > low) & (s.angle < high)
    angle, power = s.angle[chosen], s.power[chosen]
    cosine = np.cos(angle)
    shapes = [_inverse_spectrum(coefficient, cosine) for coefficient in AR_COEFFICIENTS]
    innovations = np.array([max(power @ shape / len(power), 1e-300) for shape in shapes])
    logs = np.array([np.log(shape).mean() for shape in shapes])
    misfits = len(power) * (np.log(innovations) - logs)
    likely = np.flatnonzero(misfits < misfits.min() + LIKELIHOOD_MARGIN)
    return float(AR_COEFFICIENTS[likely[0]]), float(innovations[likely[0]])
