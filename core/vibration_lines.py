"""Spectral lines of a residual: vibration of a machine nearby, if nothing else explains them.

A line is reported only if it lies inside the filters' band, is significant, and makes up a relevant
share of the residual. It must not repeat with the motion's cycles, belong to the references, their
harmonics or their rate of change, or lie at a resonance of the fitted model.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from .estimate.problem import Problem
from .identify.prepared_recording import Prepared
from .noise.repeated_motions import FEWEST_CYCLES, motion_inputs, period
from .simulate.posture import posture, vibration_modes

LINE_SIGNIFICANCE = 1e-4
"""Probability that white noise has a line as high: below it, a line is significant."""

LEAST_LINE_SHARE = 0.2
"""Least share of the squared error: removing less would reduce the rms by less than a tenth."""

WINDOW = 25
"""Frequencies on each side that a line is compared with."""

LOWEST = 3
"""Least periods within a recording: fewer are drift."""

FEWEST_PERIODS = 8
"""Least periods of a machine's vibration: below, an octave around holds little beside the line, and
model error is largest at low frequencies."""

SPREAD = 2
"""Frequencies of a Hann window's main lobe on each side of a line."""


class Line(NamedTuple):
    """A spectral line of one signal."""

    chance: float
    hz: float
    share: float
    """Share of the signal's variance."""


@dataclass(frozen=True)
class UnexplainedLine:
    """The strongest line that nothing explains."""

    channel: str
    line: Line


def lines_of(x: np.ndarray, dt: float) -> list[Line]:
    """All local peaks of x (N,), `dt` s apart, with their chances, by frequency."""
    N = len(x)
    if N < 8 * WINDOW:
        return []
    window, variance = np.hanning(N), float(np.var(x))
    if variance <= 0.0:
        return []
    # Scaled so that the ordinates of a sine add up to its mean square.
    power = np.abs(np.fft.rfft((x - x.mean()) * window)) ** 2 * 2.0 / (N * np.sum(window**2))
    windows = np.lib.stride_tricks.sliding_window_view(power, 2 * WINDOW + 1)
    median = np.pad(np.median(windows, axis=1), WINDOW, mode="edge")
    median = np.maximum(median, _within_an_octave(power))
    background = np.maximum(median / np.log(2.0), 1e-300)  # the mean that a median stands for
    # An F distribution, not an exponential: the background comes from 2 WINDOW + 1 ordinates
    # itself, half of which are independent, as a Hann window correlates neighbours.
    tail = (1.0 + power / background / WINDOW) ** -WINDOW
    chances = np.minimum((len(power) - LOWEST) * tail, 1.0)
    lines = []
    for k in range(LOWEST, len(power) - 1):
        if power[k] >= max(power[k - 1], power[k + 1]):
            near = slice(max(k - SPREAD, 1), k + SPREAD + 1)
            above = float(np.sum(power[near] - background[near]))
            lines.append(Line(float(chances[k]), k / (N * dt), max(above, 0.0) / variance))
    return lines


def _within_an_octave(power: np.ndarray) -> np.ndarray:
    """(F,) median of the ordinates from half to twice a frequency, without the main lobe: error
    that falls with frequency exceeds an even window at its lower end."""
    out = np.zeros(len(power))
    for k in range(LOWEST, min(len(power), 2 * WINDOW)):  # further up that window is the wider one
        below, beyond = power[k // 2 : k - SPREAD], power[k + SPREAD + 1 : 2 * k + 1]
        out[k] = np.median(np.concatenate([below, beyond]))
    return out


def unexplained_line(
    experiments: Sequence[Prepared], errors: Sequence[np.ndarray], fitted: Problem | None,
    above: float,
) -> UnexplainedLine | None:  # fmt: skip
    """The unexplained line with the largest share, over all recordings and channels whose error
    exceeds `above`.

    `errors` (M, k) per recording in noise floors; `fitted`: the model that left them, whose
    resonances are no machine's lines.
    """
    best: UnexplainedLine | None = None
    for i, (e, r) in enumerate(zip(experiments, errors, strict=True)):
        explained: _KnownLines | None = None
        for name, x, dt in _signals(e, r):
            if np.sqrt(np.mean(x**2)) < above:
                continue
            explained = explained or _KnownLines.of(e, fitted, i)
            size = float(np.sum((x - x.mean()) ** 2))
            x = _without_cycles(x, dt, explained.cycle)
            share = float(np.sum((x - x.mean()) ** 2)) / max(size, 1e-300)
            for line in lines_of(x, dt):
                line = line._replace(share=line.share * share)
                lasts = line.hz * len(x) * dt >= FEWEST_PERIODS
                stands_out = (
                    lasts and line.chance < LINE_SIGNIFICANCE and line.share > LEAST_LINE_SHARE
                )
                credible = stands_out and not explained.explains(line)
                if credible and (best is None or line.share > best.line.share):
                    best = UnexplainedLine(name, line)
    return best


def _signals(e: Prepared, r: np.ndarray) -> Iterator[tuple[str, np.ndarray, float]]:
    """(channel, samples (N,), sample time) of what counts, at the sensor's own rate."""
    dt = float(e.time[1] - e.time[0])
    for k, (name, _) in enumerate(e.channels):
        rows = np.flatnonzero(e.counted[:, k])
        if rows.size < 8 * WINDOW:
            continue
        stride = max(int(np.median(np.diff(rows))), 1)
        even = slice(rows[0], rows[-1] + 1, stride)
        yield name, np.where(e.counted[even, k], r[even, k], 0.0), dt * stride


def _without_cycles(x: np.ndarray, dt: float, cycle: float | None) -> np.ndarray:
    """The part of x (N,) that does not repeat with each cycle (s), in whole cycles; of three or
    more without the first, which starts from rest."""
    length = 0 if cycle is None else int(round(cycle / dt))
    count = len(x) // length if length else 0
    if count < FEWEST_CYCLES:
        return x
    cycles = x[: count * length].reshape(count, length)[1 if count > FEWEST_CYCLES else 0 :]
    return np.asarray((cycles - cycles.mean(axis=0)).ravel())


LINE_WIDTH = 2.0
"""In frequency steps of the recording: lines this close are the same."""

LEAST_REFERENCE_SHARE = 0.02
"""Least share of a reference's square for its harmonics to count."""

HARMONICS = 7
"""Harmonics of a sine under friction fall with their square: beyond the seventh they are a
hundredth."""

MOST_MIXED = 4
"""Strongest lines of the references whose sums and differences count."""

RESONANT = 0.3
"""Damping ratio up to which a pole has a peak like a line."""

RESONANCE_MARGIN = 0.05
"""Relative error of a resonance of a model that lacks something."""

SCHEDULE_POSTURES = 9
"""Postures of a moving schedule at which resonances are computed."""


@dataclass(frozen=True)
class _KnownLines:
    """Known causes of lines in one recording."""

    highest: float
    """Hz, band of the filters"""
    width: float
    """Hz between frequencies of the recording's spectrum"""
    driven: tuple[float, ...]
    """Hz, lines of the references, their harmonics and mixtures"""
    hold_hz: float
    """Hz, whose multiples may come from a held reference; 0: none is held"""
    resonances: tuple[tuple[float, float], ...]
    """(Hz, Hz to each side)"""
    cycle: float | None
    """s, after which the motion repeats"""

    @classmethod
    def of(cls, e: Prepared, fitted: Problem | None, i: int) -> _KnownLines:
        dt, N = e.recording.sample_time, len(e.recording.time)
        filters = [f for kind in {*e.kinds} for f in e.processing.filters(kind)]
        commanded = e.model.steering is None
        references = e.task.references if commanded else np.zeros((N, 0))
        cycle = period(motion_inputs(e))
        return cls(
            highest=min((f.cutoff_hz for f in filters), default=np.inf),
            width=1.0 / (N * dt),
            driven=_driven(references, dt),
            hold_hz=_hold_hz(references, dt),
            resonances=() if fitted is None else _resonances(fitted, i),
            cycle=None if cycle is None else cycle * dt,
        )

    def explains(self, line: Line) -> bool:
        """Whether the line lies outside the band or has a known cause."""
        width = LINE_WIDTH * self.width
        hold = self.hold_hz
        nearest = abs(line.hz - hold * np.round(line.hz / hold)) if hold else np.inf
        return (
            line.hz > self.highest
            or any(abs(line.hz - hz) < width for hz in self.driven)
            or nearest < width
            or any(abs(line.hz - hz) < max(width, side) for hz, side in self.resonances)
        )


def _driven(references: np.ndarray, dt: float) -> tuple[float, ...]:
    """Hz: lines of references (N, k), their harmonics, sums and differences."""
    lines = [
        line
        for column in references.T
        for line in lines_of(column, dt)
        if line.chance < LINE_SIGNIFICANCE and line.share > LEAST_REFERENCE_SHARE
    ]
    strongest = sorted(lines, key=lambda x: -x.share)[:MOST_MIXED]
    frequencies = [n * line.hz for line in lines for n in range(1, HARMONICS + 1)]
    for a, b in combinations(strongest, 2):
        frequencies += [a.hz + b.hz, abs(a.hz - b.hz)]
    return tuple(frequencies)


def _hold_hz(references: np.ndarray, dt: float) -> float:
    """Hz: half the rate at which held references (N, k) change, as values often come with their
    negatives; 0 if they change at each sample."""
    changes = np.flatnonzero(np.any(np.diff(references, axis=0) != 0.0, axis=1))
    if changes.size < 2:
        return 0.0
    hold = int(np.gcd.reduce(np.diff(changes)))
    return 0.5 / (hold * dt) if hold > 1 else 0.0


def _resonances(fitted: Problem, i: int) -> tuple[tuple[float, float], ...]:
    """(Hz, Hz to each side) of the resonances of the fitted model along recording i. Only effects
    with a linear model count: the slope of friction at rest says nothing about a motion."""
    e = fitted.residuals.experiments[i]
    values = fitted.residuals.predictor.values(e, fitted.vector)
    smooth = [effect for effect in fitted.model.effects if effect.linear]
    model = fitted.model.with_effects(smooth, {**fitted.model.effect_values, **values})
    numbers, schedule = model.numbers(values), e.task.schedule
    rows = np.unique(np.linspace(0, len(schedule) - 1, SCHEDULE_POSTURES).astype(int))
    modes = [
        mode
        for row in rows
        for mode in vibration_modes(posture(model, schedule[row, : model.arm.joints], numbers))
        if mode.damping < RESONANT
    ]
    return tuple((m.frequency, (m.damping + RESONANCE_MARGIN) * m.frequency) for m in modes)
