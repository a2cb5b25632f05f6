"""Full refits of the most promising candidates."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..effects.effect import Effect
from ..estimate.problem import FitData, Problem, problem_of, with_values
from ..estimate.starts import ROUGH_ITERATIONS, TRIAL_ITERATIONS, starts
from ..identify.identifiability import analyse, identified
from ..identify.uncertainty import LEAST_EIGENVALUE, covariance
from ..least_squares import (
    FIRST_DAMPING,
    GOOD_ENOUGH,
    MOST_ITERATIONS,
    SEEN,
    Descended,
    as_finite,
    cost_of,
    levenberg_marquardt,
    normal_equations,
    pseudo_inverse,
    triangular,
    with_prior,
)
from ..noise.whitening import Whitener


@dataclass(frozen=True)
class FitResult:
    """A model fitted with one more effect."""

    problem: Problem
    """The model at the fitted vector."""
    descended: Descended
    whitened_cost: float
    """Whitened squared error at its own minimum."""
    covariance: np.ndarray
    """(P, P) from the whitened information; robust after `with_robust_covariance`."""

    @property
    def cost(self) -> float:
        """Weighted sum of squares at the end of the descent, what is known a priori included."""
        problem = self.problem
        return self.descended.cost + float(problem.limits.prior_cost(problem.vector))

    @property
    def errors(self) -> tuple[np.ndarray, ...]:
        """Weighted residuals of each recording."""
        return self.descended.blocks


SlopesByLabel = Mapping[str, tuple[np.ndarray, ...]]
"""label -> sensitivity (M, k) per recording to an unknown."""


def fit(
    start: Problem, whitener: Whitener | None, stopped: Callable[[], bool],
    most: int = MOST_ITERATIONS, reused: SlopesByLabel | None = None,
    damping: float = FIRST_DAMPING, exact_directions: bool = False,
) -> FitResult:  # fmt: skip
    """Descend from the model; then one linear step to the whitened minimum.

    `damping`: of the first step, a share of the normal equations' diagonal (Marquardt 1963).
    Sensitivities in `reused` are not computed again: those to nuisance unknowns hardly change with
    an effect, and a descent needs only their direction. `exact_directions`: if such directions stop
    reducing the cost, exact ones are used. While an effect is missing, a step that gains a tiny
    share of a large error is the last.
    """
    descended = levenberg_marquardt(
        start.errors, lambda x: start.slopes_reusing(x, reused or {}), start.vector, start.limits,
        stopped, most=most, damping=damping, exact=start.exact_slopes if exact_directions else None,
        share=GOOD_ENOUGH,
    )  # fmt: skip
    at = start.at(descended.vector)
    if whitener is None or not len(descended.vector):
        P = len(descended.vector)
        return FitResult(at, descended, descended.cost, np.full((P, P), np.nan))
    whitened, covariance = whitened_cost(at, descended, whitener)
    return FitResult(at, descended, whitened, covariance)


def whitened_cost(
    at: Problem, descended: Descended, whitener: Whitener
) -> tuple[float, np.ndarray]:
    """Least whitened squared error near a minimum, and the covariance there. Parameters at a bound
    stay there."""
    slopes = [whitener(i, s) for i, s in enumerate(descended.slopes)]
    blocks = [whitener(i, b) for i, b in enumerate(descended.blocks)]
    x, limits = descended.vector, at.limits
    A, b = with_prior(*normal_equations(blocks, slopes), x, limits)
    cost = float(sum(np.sum(r * r) for r in blocks) + limits.prior_cost(x))
    which = np.flatnonzero(limits.inside(x) & (np.diag(A) > 0.0))
    inverse = pseudo_inverse(A[np.ix_(which, which)])
    covariance = np.full(A.shape, np.nan)
    covariance[np.ix_(which, which)] = inverse
    return cost - float(b[which] @ inverse @ b[which]), covariance


def with_whitened_cost(refit: FitResult, whitener: Whitener) -> FitResult:
    """The refit with the whitened cost of this whitener."""
    return replace(refit, whitened_cost=whitened_cost(refit.problem, refit.descended, whitener)[0])


def refit_with(
    data: FitData, base: Problem, effects: Sequence[Effect],
    values: Mapping[str, float], whitener: Whitener, slopes: Sequence[np.ndarray],
    scanned: Sequence[str], stopped: Callable[[], bool],
) -> FitResult:  # fmt: skip
    """Fit the model with `effects` from the best of several starts, which are compared coarsely
    after a few iterations.

    `slopes` are the base's, (M, k, P) per recording; the parameters `scanned` have no slope at
    neutral.
    """
    start, spent, reused = best_start(data, base, effects, values, slopes, scanned, stopped)
    return with_precise_errors(
        data, fit(start, None, stopped, ROUGH_ITERATIONS - spent, reused), whitener
    )


def best_start(
    data: FitData, base: Problem, effects: Sequence[Effect],
    values: Mapping[str, float], slopes: Sequence[np.ndarray], scanned: Sequence[str],
    stopped: Callable[[], bool],
) -> tuple[Problem, int, SlopesByLabel]:  # fmt: skip
    """The best start, the iterations spent to find it, and the slopes of its nuisance unknowns."""
    candidates = starts(data, base, effects, values, scanned, stopped)
    tried = [problem_of(data, effects, start) for start in candidates]
    of_base = slopes_by_label(base, slopes)
    if len(tried) < 2 or stopped():
        return tried[0], 0, of_base
    reused = [
        of_base if k == 0 else _own_slopes(problem, of_base) for k, problem in enumerate(tried)
    ]
    trials = [
        fit(problem.half_substeps, None, stopped, TRIAL_ITERATIONS, own)
        for problem, own in zip(tried, reused, strict=True)
    ]
    best = min(range(len(tried)), key=lambda k: trials[k].cost)
    return tried[best].at(trials[best].problem.vector), TRIAL_ITERATIONS, reused[best]


def _own_slopes(problem: Problem, labels: Collection[str]) -> SlopesByLabel:
    """Those of the `labels` where a model stands: the base's hold near the base alone. A base whose
    free first states had taken up friction had beams ten times too stiff, whose slopes took the
    refits from the nominal values nowhere."""
    own = slopes_by_label(problem, problem.half_substeps.slopes(problem.vector))
    return {label: own[label] for label in own.keys() & set(labels)}


COMPARED_SUBSTEPS = 2
"""Factor on the steps per sample for errors that are compared: step errors must not decide."""


def with_precise_errors(data: FitData, rough: FitResult, whitener: Whitener) -> FitResult:
    """The refit with its errors simulated as finely as those of the base."""
    problem = rough.problem
    fine = with_values(data, problem, refine=COMPARED_SUBSTEPS)
    blocks = tuple(fine.errors(problem.vector))
    cost = cost_of(blocks)
    descended = replace(rough.descended, blocks=blocks, cost=cost)
    if not np.isfinite(cost):
        return replace(rough, descended=descended)
    whitened, covariance = whitened_cost(problem, descended, whitener)
    return FitResult(problem, descended, whitened, covariance)


def slopes_by_label(base: Problem, slopes: Sequence[np.ndarray]) -> SlopesByLabel:
    """Sensitivities of the base (M, k, P) per recording, by label."""
    return {
        label: tuple(S[:, :, j] for S in slopes) for j, label in enumerate(base.unknowns.labels)
    }


def with_robust_covariance(refit: FitResult) -> FitResult:
    """The refit with the standard deviations that are stated."""
    return replace(refit, covariance=robust_covariance(refit))


def robust_covariance(
    refit: FitResult, relative: float = LEAST_EIGENVALUE, ignore_bounds: bool = False
) -> np.ndarray:
    """(P, P) covariance of a least-squares minimum under coloured noise; NaN for parameters at a
    bound, unless `ignore_bounds`.

    It is the sandwich estimate from the noise's own autocovariance (core.identify.uncertainty), not
    the inverse of the whitened information. It is zero along directions whose `relative` eigenvalue
    of the normal equations is smaller.
    """
    problem, x = refit.problem, refit.problem.vector
    inside = np.flatnonzero(problem.limits.inside(x) | ignore_bounds)
    slopes = [S[:, :, inside] for S in refit.descended.slopes]
    out = np.full((len(x), len(x)), np.nan)
    if len(inside):
        known, counted = np.asarray(problem.limits.deviations)[inside], problem.residuals.counted
        out[np.ix_(inside, inside)] = covariance(
            slopes, refit.errors, counted, len(inside), relative, known
        )
    return out


def identified_unknowns(refit: FitResult) -> np.ndarray:
    """(P,) bool: unknowns that the measurements determine."""
    problem, slopes = refit.problem, refit.descended.slopes
    if not len(problem.vector):
        return np.zeros(0, dtype=bool)
    jacobian = triangular([as_finite(S) for S in slopes])
    _, _, null = analyse(problem.unknowns, problem.vector, jacobian, SEEN**0.5)
    return identified(null, len(problem.vector))
