"""Smooth functions of errors that were never simulated: outputs answer a force as a filter does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from flexgui.core.propose.carriers import ErrorParts, SmoothFunction, cut, hats, parts_of
from flexgui.core.propose.targets import force_targets
from flexgui.core.propose.variables import Factor, Series, Variable
from tests.helpers import PAPER

LOW, HIGH = 0.3, 2.3
"""rad, ends of the place."""

FILTERS = [((0.02,), (1.0, -0.98)), ((0.05, -0.05), (1.0, -1.9, 0.905))]
"""Numerators and denominators of the two outputs."""

NUISANCE = 3
BEGINNING = 12
"""Samples."""
JOINT_2 = force_targets(PAPER)[1]


@dataclass(frozen=True)
class MadeUp:
    """Recordings in which a place wanders through its range, with errors of a known function."""

    torque: Callable[[np.ndarray], np.ndarray]
    """At joint 2, in noise floors of what the outputs answer, over its place."""
    samples: int = 600
    recordings: int = 3
    noise: float = 1.0
    """Of the errors, in noise floors."""
    seed: int = 0
    begins: bool = False
    """Whether the nuisance dies away, as the answer to a start does."""

    @cached_property
    def places(self) -> Series:
        """(N,) of each recording: two waves without a common period, through all of the range."""
        rng = np.random.default_rng(self.seed)
        time = np.arange(self.samples)[:, None] / self.samples
        found = []
        for _ in range(self.recordings):
            turns, phases = rng.uniform(9.0, 25.0, 2), rng.uniform(0.0, 2.0 * np.pi, 2)
            wave = np.sum(np.sin(2.0 * np.pi * turns * time + phases), axis=1)
            found.append(np.interp(wave, (wave.min(), wave.max()), (LOW, HIGH)))
        return tuple(found)

    def errors(self, factor: Series) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Errors (M, k) and nuisance (M, k, P) of each recording; some of it is in the errors."""
        rng = np.random.default_rng(self.seed + 1)
        errors, nuisance = [], []
        for x, f in zip(self.places, factor, strict=True):
            own = rng.normal(size=(len(x), len(FILTERS), NUISANCE))
            if self.begins:
                own *= np.exp(-np.arange(len(x)) / BEGINNING)[:, None, None]
            error = answer(self.torque(x) * f) + own @ np.array([0.5, -0.2, 0.1])
            errors.append(error + self.noise * rng.normal(size=error.shape))
            nuisance.append(own)
        return errors, nuisance

    def function(
        self, knots: int = 25, factor: Factor | None = None, variable: Variable | None = None
    ) -> SmoothFunction:
        """What `smooth_functions` makes of the errors."""
        x = variable or place(self.places)
        factor = factor or torque(self.places)
        errors, nuisance = self.errors(factor.along)
        blocks = [np.concatenate([a, b[..., None]], axis=-1)
                  for a, b in zip(nuisance, errors, strict=True)]  # fmt: skip
        count = sum(error.size for error in errors)
        parts, prior = parts_of(errors), np.zeros((NUISANCE + 1, NUISANCE + 1))
        at = ErrorParts(cut(blocks, parts), prior, parts, count)
        where = np.linspace(min(a.min() for a in x.along), max(a.max() for a in x.along), knots)
        columns = [tuple(answer(s) for s in signal) for signal in hats(x, factor, where)]
        return SmoothFunction(JOINT_2, x, factor, where, at.matrices(columns))


def answer(signal: np.ndarray) -> np.ndarray:
    """(N, 2): what the outputs answer a force (N,)."""
    return np.stack([scipy.signal.lfilter(b, a, signal) for b, a in FILTERS], axis=1)


def place(along: Series) -> Variable:
    return Variable("theta2", "position of joint 2", "rad", along, whole_turns=True, place=True)


def torque(places: Series) -> Factor:
    """Nothing that the function is multiplied by."""
    return Factor("Torque", "", "", "", tuple(np.ones(len(x)) for x in places))
