"""Recordings that no fit has seen: what a fitted model leaves there, and whether another one leaves
surely more."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..estimate.fit_result import FitResult, fit
from ..estimate.minimum import RELEVANT
from ..estimate.problem import FitData, Problem, parameter_names, problem_of
from ..identify.unknowns import Unknown

VALIDATION_ITERATIONS = 4
"""Offsets and starts of a recording enter almost linearly."""


PIECES = 16
"""Of each unseen recording, whose errors are compared: more than a noise remembers lies in one."""

SURE = 2.0
"""Deviations by which unseen recordings must differ to decide."""


def _refitted_unknowns(validation: FitData, problem: Problem) -> tuple[Unknown, ...]:
    """Sizes of effects that belong to the validation rig."""
    model = problem.model
    own = [e for e in model.effects if e.kind in validation.per_recording]
    names = {name for e in own for name in parameter_names(e, model, validation.sizes)}
    return tuple(u for u in problem.unknowns.items if u.parameter.name in names)


@dataclass(frozen=True)
class ValidationFit:
    """A fitted model on validation recordings."""

    data: FitData
    fit: FitResult

    @property
    def problem(self) -> Problem:
        """The model at what was fitted."""
        return self.fit.problem

    @property
    def errors(self) -> Sequence[np.ndarray]:
        """(M, k) per recording, in floors."""
        return self.fit.errors


def fit_validation(validation: FitData | None, refit: FitResult) -> ValidationFit | None:
    """A refit of what belongs to each validation recording alone; all else is fixed. None without
    validation recordings."""
    if validation is None:
        return None
    problem = refit.problem
    shared = {k: v for k, v in problem.values().items() if "@" not in k}
    refitted = _refitted_unknowns(validation, problem)
    shared = {k: v for k, v in shared.items() if k not in {u.parameter.name for u in refitted}}
    own = tuple(u for u in validation.nuisance if u.recording is not None)
    fixed = {**validation.fixed, **shared}
    fixed_data = replace(validation, nuisance=own, fixed=fixed, substeps=validation.result_substeps)
    values = problem.all_values()
    start = problem_of(fixed_data, problem.model.effects, values, freed=refitted)
    return ValidationFit(fixed_data, fit(start, None, lambda: False, VALIDATION_ITERATIONS))


@dataclass(frozen=True)
class UnseenChange:
    """By how much one model leaves more than another on recordings that no fit has seen."""

    before: float
    """Squared error per sample of the first, in squared noise floors."""
    change: float
    deviation: float
    """Standard deviation of the change."""

    @classmethod
    def between(cls, before: ValidationFit, after: ValidationFit) -> UnseenChange:
        """From one model to another."""
        pieces, squares, count = list[float](), 0.0, before.data.count
        for a, b in zip(before.errors, after.errors, strict=True):
            squares += float(np.sum(a**2))
            pieces += [float(np.sum(x)) for x in np.array_split(b**2 - a**2, PIECES)]
        spread = float(np.std(pieces)) * math.sqrt(len(pieces))
        return cls(squares / count, float(np.sum(pieces)) / count, spread / count)

    @property
    def surely_worse(self) -> bool:
        """Whether the second leaves more, relevantly and beyond its deviation."""
        return not self.change <= max(RELEVANT, SURE * self.deviation)

    @property
    def refutes(self) -> bool:
        """Whether it speaks against the second: surely worse, or no better although its errors are
        others by more than is relevant."""
        return self.surely_worse or (self.change > 0.0 and self.deviation > RELEVANT)

    @property
    def surely_better(self) -> bool:
        """Whether it leaves less."""
        return self.change < -max(RELEVANT, SURE * self.deviation)

    @property
    def rms(self) -> tuple[float, float]:
        """Of both, in noise floors."""
        return math.sqrt(self.before), math.sqrt(max(self.before + self.change, 0.0))
