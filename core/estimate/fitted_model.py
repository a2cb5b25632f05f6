"""Fitted models: a set of effects with the minimum of its cost.

A fit does not depend on the noise beyond the weights of its channels. Seen against another noise,
its errors and their slopes are multiplied by the ratio, and one linear step leads to the minimum
with the other weights. So a new estimate of the noise costs no simulation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..effects.effect import Effect
from ..estimate.fit_result import FitResult, with_robust_covariance
from ..estimate.minimum import converge, law_error
from ..estimate.problem import FitData, problem_of, within_noise
from ..least_squares import cost_of, normal_equations, pseudo_inverse, with_prior


@dataclass(frozen=True)
class FittedModel:
    """A model at its minimum."""

    data: FitData
    """Anchored at the model."""
    refit: FitResult
    effects: tuple[Effect, ...]
    """Those that were stated first."""

    @property
    def key(self) -> tuple[str, ...]:
        """What identifies the model: bending shapes per segment, and the set of effects."""
        return (*map(str, self.data.bare.arm.modes), *sorted(e.kind for e in self.effects))

    def against(self, like: FitData) -> FittedModel:
        """The model against the noise of other data of the same recordings."""
        if like.floors == self.data.floors:
            return self
        data = replace(
            self.data, weights=like.weights, noise_ratios=like.noise_ratios, floors=like.floors,
            floor_sources=like.floor_sources, floor_uncertainty=like.floor_uncertainty,
            tolerances=like.tolerances,
        )  # fmt: skip
        refit = weighted(self.refit, self.data, data)
        anchored = replace(data, anchor=refit.problem.residuals.anchor)
        return replace(self, data=anchored, refit=refit)

    @cached_property
    def with_law_errors(self) -> FittedModel:
        """The model with what its idealised laws may miss."""
        return replace(self, data=replace(self.data, law_errors=law_error(self.data, self.refit)))

    @cached_property
    def within_laws(self) -> bool:
        """Whether its error is above the noise, but within what its idealised laws may miss."""
        if within_noise(self.data, self.refit.errors):
            return False
        return within_noise(self.with_law_errors.data, self.refit.errors)


def fit_model(
    data: FitData, effects: Sequence[Effect], values: Mapping[str, float],
    stopped: Callable[[], bool],
) -> FittedModel:  # fmt: skip
    """The model with these effects, converged from `values` (label -> value)."""
    start = problem_of(replace(data, anchor=None), effects, values)
    return FittedModel(*converge(replace(data, anchor=None), start, None, stopped), tuple(effects))


def weight_ratios(old: FitData, new: FitData) -> list[np.ndarray]:
    """(k,) per recording: new weights of the channels over the old ones."""
    return [b / a for a, b in zip(old.weights, new.weights, strict=True)]


def weighted(refit: FitResult, old: FitData, new: FitData) -> FitResult:
    """A refit of `old` data with the weights of `new`, at the minimum of these by a linear step."""
    ratios, problem = weight_ratios(old, new), refit.problem
    blocks = [b * r for b, r in zip(refit.errors, ratios, strict=True)]
    slopes = [S * r[:, None] for S, r in zip(refit.descended.slopes, ratios, strict=True)]
    move = np.zeros(len(problem.vector))
    inside = np.flatnonzero(problem.limits.inside(problem.vector))
    if len(inside):
        A, b = with_prior(*normal_equations(blocks, slopes), problem.vector, problem.limits)
        move[inside] = -pseudo_inverse(A[np.ix_(inside, inside)]) @ b[inside]
    vector = np.clip(problem.vector + move, problem.limits.lower, problem.limits.upper)
    moved = [b + S @ (vector - problem.vector) for b, S in zip(blocks, slopes, strict=True)]
    before, after = (float(problem.limits.prior_cost(x)) for x in (problem.vector, vector))
    if not cost_of(moved) + after < cost_of(blocks) + before:
        vector, moved = problem.vector, blocks
    anchor = (
        None if problem.residuals.anchor is None else problem.residuals.anchor.weighted(new.weights)
    )
    at = replace(
        problem.at(vector), residuals=replace(problem.residuals, weights=new.weights, anchor=anchor)
    )
    descended = replace(
        refit.descended, vector=vector, blocks=tuple(moved), slopes=tuple(slopes),
        cost=cost_of(moved),
    )  # fmt: skip
    return with_robust_covariance(
        replace(refit, problem=at, descended=descended, whitened_cost=cost_of(moved))
    )
