"""Sizes at which an effect's own vibration swings as the error does.

What is soft swings, and a model whose vibration is a little too slow or too fast explains nothing
of one that lasts: it runs out of step. So the error has a narrow valley at the true size, which a
grid misses. But the spectrum of the error says where the vibration is, and the linear model says
which size puts one there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from core.arm.structure import Structure
from core.diagnose.data import Data, Hypothesis
from core.drives.servo import FollowingServo
from core.effects.effect import Effect
from core.identify.prepared import Prepared
from core.model import Model
from core.simulate.modes import vibration_modes
from core.simulate.posture import posture

PROMINENT = 5.0
"""Times the median amplitude around it. Of noise the largest of a thousand lines stands
sqrt(ln 1000 / ln 2) = 3.2 medians high."""

AROUND = 2.0
"""Factor of frequency within which the median is taken."""

FEWEST_LINES = 4
"""Of a spectrum: what swings fewer times in a recording is no vibration yet."""

MOST_PEAKS = 3
"""Of one recording, the most prominent."""

MOST_RECORDINGS = 3
"""Whose peaks are sought: all of them show the same size."""

SIZES = 48
"""At which the frequencies are calculated; between them they run smoothly."""


def resonant_sizes(
    data: Data,
    base: Hypothesis,
    effects: Sequence[Effect],
    values: Mapping[str, float],
    name: str,
    bounds: tuple[float, float],
) -> list[float]:
    """Sizes of the parameter `name` between `bounds` (both positive) at which the model with
    `effects` has a vibration where the error of `base` has one; none where the effects leave the
    arm's structure as it is, so that a grid with a descent does."""
    model = data.bare.with_effects(effects, {**values}, data.sizes)
    if Structure.of(model.arm) == Structure.of(base.model.arm):
        return []
    if name not in model.arm_catalogue.entries:
        return []
    errors = base.errors(base.vector)
    found = [(_peaks(e, r), e) for e, r in zip(data.experiments, errors, strict=True)]
    found = [each for each in found if each[0]]
    found.sort(key=lambda each: -max(height for _, height in each[0]))
    sizes = np.geomspace(*bounds, SIZES)
    chosen: list[float] = []
    for peaks, e in found[:MOST_RECORDINGS]:
        modes = [_frequencies(model, e, {**values, name: float(x)}) for x in sizes]
        for frequency, _ in peaks:
            chosen += _crossings(sizes, modes, frequency)
    return chosen


def _peaks(e: Prepared, errors: np.ndarray) -> list[tuple[float, float]]:
    """(Hz, times the median around it) of the most prominent lines of the errors (M, k)."""
    dt = float(e.time[1] - e.time[0])
    found: dict[int, float] = {}
    for k in range(errors.shape[1]):
        column = np.where(e.counted[:, k], errors[:, k], 0.0)
        lines = np.abs(np.fft.rfft((column - column.mean()) * np.hanning(len(column))))
        for i in range(FEWEST_LINES, len(lines) - 1):
            if lines[i] < max(lines[i - 1], lines[i + 1]):
                continue
            near = lines[int(i / AROUND) : int(i * AROUND) + 1]
            height = float(lines[i] / max(np.median(near), 1e-300))
            if height > PROMINENT:
                found[i] = max(found.get(i, 0.0), height)
    best = sorted(found, key=lambda i: -found[i])[:MOST_PEAKS]
    return [(i / (len(errors) * dt), found[i]) for i in best]


def _frequencies(model: Model, e: Prepared, values: Mapping[str, float]) -> np.ndarray:
    """(m,) Hz of the vibrations at the recording's first posture, slowest first."""
    numbers = model.numbers(values)
    joints = e.task.schedule[0, : model.arm.joints]
    held = isinstance(model.steering, FollowingServo)
    at = posture(model, joints, numbers)
    return np.array([mode.frequency for mode in vibration_modes(at, clamped=held)])


def _crossings(sizes: np.ndarray, modes: Sequence[np.ndarray], frequency: float) -> list[float]:
    """Sizes at which one of the vibrations has that frequency, interpolated in logarithms."""
    found = []
    for (x, a), (y, b) in zip(
        zip(sizes, modes, strict=True), zip(sizes[1:], modes[1:], strict=True), strict=False
    ):
        if len(a) != len(b):
            continue  # a vibration begins or ends here, and the rest cannot be told apart
        for f, g in zip(a, b, strict=True):
            if (f - frequency) * (g - frequency) < 0.0:
                share = np.log(frequency / f) / np.log(g / f)
                found.append(float(np.exp(np.log(x) + share * np.log(y / x))))
    return found
