"""Spectral lines of what a model leaves over: a machine nearby, if nothing else explains them.

A line is told only where all of this holds: it lies inside the band that the filters leave; it is
no chance; it makes up a relevant share of what is left; it does not come back with the motion's
cycles, and is neither in the references nor a harmonic of theirs or of the pace at which they
change; and the fitted model does not ring there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ..diagnose.fit_problem import Hypothesis
from ..diagnose.repeated_motions import FEWEST_CYCLES, inputs_of, period
from ..identify.prepared import Prepared
from ..simulate.posture import posture, vibration_modes

CHANCE = 1e-4
"""That white noise shows a spectral line as high: below it, it is one."""

SHARE = 0.2
"""Of the squared error: without less than that the rms would fall by less than a tenth, and nobody
would look for a machine."""

WINDOW = 25
"""Frequencies on each side against which a line is judged."""

LOWEST = 3
"""Periods within a recording: below, a drift is no line."""

FEWEST_PERIODS = 8
"""The same of a machine nearby: below, an octave around holds little beside the line itself, and
what a model misses is largest at low frequencies anyhow."""

SPREAD = 2
"""Frequencies of a Hann window's main lobe on each side of a line."""


class Line(NamedTuple):
    """A line of one signal."""

    chance: float
    hz: float
    share: float
    """Of the signal's squared deviation from its mean."""


@dataclass(frozen=True)
class Vibration:
    """The strongest line that nothing explains."""

    channel: str
    line: Line


def line_of(x: np.ndarray, dt: float) -> Line | None:
    """The highest line of x (N,) over its neighbourhood; None for short signals."""
    found = lines_of(x, dt)
    return max(found, key=lambda one: -one.chance) if found else None


def lines_of(x: np.ndarray, dt: float) -> list[Line]:
    """All local peaks of x (N,) with their chances, in the order of their frequencies."""
    N = len(x)
    if N < 8 * WINDOW:
        return []
    window, variance = np.hanning(N), float(np.var(x))
    if variance <= 0.0:
        return []
    # Scaled so that the ordinates of a sine add up to its mean square.
    power = np.abs(np.fft.rfft((x - x.mean()) * window)) ** 2 * 2.0 / (N * np.sum(window**2))
    padded = np.pad(power, WINDOW, mode="reflect")
    around = np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * WINDOW + 1), axis=1)
    around = np.maximum(around, _within_an_octave(power))
    background = np.maximum(around / np.log(2.0), 1e-300)  # the mean that a median stands for
    ratio = np.minimum(power / background, 700.0)
    chances = np.minimum((len(power) - LOWEST) * np.exp(-ratio), 1.0)
    found = []
    for k in range(LOWEST, len(power) - 1):
        if power[k] >= max(power[k - 1], power[k + 1]):
            near = slice(max(k - SPREAD, 1), k + SPREAD + 1)
            above = float(np.sum(power[near] - background[near]))
            found.append(Line(float(chances[k]), k / (N * dt), max(above, 0.0) / variance))
    return found


def _within_an_octave(power: np.ndarray) -> np.ndarray:
    """(F,) median of the ordinates from half to twice a frequency, without its own main lobe: an
    error that falls with the frequency stands out of a window of even width at its lower end."""
    out = np.zeros(len(power))
    for k in range(LOWEST, min(len(power), 2 * WINDOW)):  # further up that window is the wider one
        below, beyond = power[k // 2 : k - SPREAD], power[k + SPREAD + 1 : 2 * k + 1]
        out[k] = np.median(np.concatenate([below, beyond]))
    return out


def unexplained_line(
    experiments: Sequence[Prepared],
    errors: Sequence[np.ndarray],
    fitted: Hypothesis | None,
    above: float,
) -> Vibration | None:
    """The line with the largest share over all recordings and channels whose error exceeds `above`.

    `errors` (M, k) per recording in floors; `fitted` the model that left them, whose resonances
    are no lines of a machine.
    """
    best: Vibration | None = None
    for i, (e, r) in enumerate(zip(experiments, errors, strict=True)):
        known: _Known | None = None
        for name, x, dt in _signals(e, r):
            if np.sqrt(np.mean(x**2)) < above:
                continue
            known = known or _Known.of(e, fitted, i)
            size = float(np.sum((x - x.mean()) ** 2))
            x = _without_cycles(x, dt, known.cycle)
            left = float(np.sum((x - x.mean()) ** 2)) / max(size, 1e-300)
            for line in lines_of(x, dt):
                line = line._replace(share=line.share * left)
                lasts = line.hz * len(x) * dt >= FEWEST_PERIODS
                stands_out = lasts and line.chance < CHANCE and line.share > SHARE
                credible = stands_out and not known.explains(line)
                if credible and (best is None or line.share > best.line.share):
                    best = Vibration(name, line)
    return best


def _signals(e: Prepared, r: np.ndarray) -> Iterator[tuple[str, np.ndarray, float]]:
    """(channel, samples (N,), sample time) of what counts, at the sensor's own pace."""
    dt = float(e.time[1] - e.time[0])
    for k, (name, _) in enumerate(e.channels):
        rows = np.flatnonzero(e.counted[:, k])
        if rows.size < 8 * WINDOW:
            continue
        stride = max(int(np.median(np.diff(rows))), 1)
        even = slice(rows[0], rows[-1] + 1, stride)
        yield name, np.where(e.counted[even, k], r[even, k], 0.0), dt * stride


def _without_cycles(x: np.ndarray, dt: float, cycle: float | None) -> np.ndarray:
    """What of x (N,) does not come back with each cycle (s); whole cycles only, of three or more
    without the first, which starts from rest."""
    length = 0 if cycle is None else int(round(cycle / dt))
    count = len(x) // length if length else 0
    if count < FEWEST_CYCLES:
        return x
    cycles = x[: count * length].reshape(count, length)[1 if count > FEWEST_CYCLES else 0 :]
    return np.asarray((cycles - cycles.mean(axis=0)).ravel())


BESIDE = 2.0
"""Widths of a recording's frequencies: so near a line belongs to another one."""

PRESENT = 0.02
"""Of a reference's squared size: what makes a line of it worth its harmonics."""

HARMONICS = 7
"""A friction answers a sine with odd ones that fall with their square: beyond it is a hundredth."""

MIXED = 4
"""Strongest lines of the references whose sums and differences are looked at."""

RINGS = 0.3
"""Damping ratio up to which a pole shows a peak that could be taken for a line."""

OFF = 0.05
"""Relative: by how much a resonance of a model that lacks something lies beside the real one."""

PLACES = 9
"""Of a moving schedule, at which resonances are looked up."""


@dataclass(frozen=True)
class _Known:
    """What explains lines of one recording."""

    highest: float
    """Hz, of what the filters leave"""
    width: float
    """Hz between frequencies of the recording's spectrum"""
    driven: tuple[float, ...]
    """Hz, of the references, their harmonics and mixtures"""
    pace: float
    """Hz, of which any multiple may come from a reference that is held; 0 where none is"""
    resonances: tuple[tuple[float, float], ...]
    """(Hz, Hz to each side)"""
    cycle: float | None
    """s, after which the motion repeats"""

    @classmethod
    def of(cls, e: Prepared, fitted: Hypothesis | None, i: int) -> _Known:
        dt, N = e.recording.sample_time, len(e.recording.time)
        filters = [f for kind in {*e.kinds} for f in e.processing.filters(kind)]
        commanded = e.model.steering is None
        references = e.task.references if commanded else np.zeros((N, 0))
        cycle = period(inputs_of(e))
        return cls(
            highest=min((f.cutoff_hz for f in filters), default=np.inf),
            width=1.0 / (N * dt),
            driven=_driven(references, dt),
            pace=_pace(references, dt),
            resonances=() if fitted is None else _resonances(fitted, i),
            cycle=None if cycle is None else cycle * dt,
        )

    def explains(self, line: Line) -> bool:
        """Whether the line lies outside the band, or is no surprise where it is."""
        beside = BESIDE * self.width
        nearest = abs(line.hz - self.pace * np.round(line.hz / self.pace)) if self.pace else np.inf
        return (
            line.hz > self.highest
            or any(abs(line.hz - hz) < beside for hz in self.driven)
            or nearest < beside
            or any(abs(line.hz - hz) < max(beside, side) for hz, side in self.resonances)
        )


def _driven(references: np.ndarray, dt: float) -> tuple[float, ...]:
    """Hz of the lines of references (N, k), of their harmonics, sums and differences."""
    lines = [
        line
        for column in references.T
        for line in lines_of(column, dt)
        if line.chance < CHANCE and line.share > PRESENT
    ]
    strongest = sorted(lines, key=lambda one: -one.share)[:MIXED]
    found = [n * line.hz for line in lines for n in range(1, HARMONICS + 1)]
    for a, b in combinations(strongest, 2):
        found += [a.hz + b.hz, abs(a.hz - b.hz)]
    return tuple(found)


def _pace(references: np.ndarray, dt: float) -> float:
    """Hz, half of that at which references (N, k) change that are held for several samples; 0 where
    they change at each. Half, because values often come with their negatives."""
    changes = np.flatnonzero(np.any(np.diff(references, axis=0) != 0.0, axis=1))
    if changes.size < 2:
        return 0.0
    hold = int(np.gcd.reduce(np.diff(changes)))
    return 0.5 / (hold * dt) if hold > 1 else 0.0


def _resonances(fitted: Hypothesis, i: int) -> tuple[tuple[float, float], ...]:
    """(Hz, Hz to each side) where the fitted model rings along recording i.

    Of the effects only those with a place in a linear model: the slope of a friction at rest says
    nothing about a motion.
    """
    e = fitted.residuals.experiments[i]
    values = fitted.residuals.predictor.values(e, fitted.vector)
    smooth = [one for one in fitted.model.effects if one.linear]
    model = fitted.model.with_effects(smooth, {**fitted.model.effect_values, **values})
    numbers, schedule = model.numbers(values), e.task.schedule
    rows = np.unique(np.linspace(0, len(schedule) - 1, PLACES).astype(int))
    modes = [
        mode
        for row in rows
        for mode in vibration_modes(posture(model, schedule[row, : model.arm.joints], numbers))
        if mode.damping < RINGS
    ]
    return tuple((m.frequency, (m.damping + OFF) * m.frequency) for m in modes)
