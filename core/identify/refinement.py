"""Bounded least-squares refinement over a growing horizon.

A vibration with a frequency error Df is out of phase after 1 / (2 Df). Over a long recording the
cost has many minima, and a descent from a stiffness that is a third off ends in a wrong one. Over
the first few periods the cost has one minimum, whose estimate is good enough for twice the time,
and so on. (As in A. Voss, J. Timmer, J. Kurths, Int. J. Bifurcation and Chaos 14, 2004, for
multiple shooting.)
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from ..identify.defect_correction import with_enough_steps
from ..identify.predictor import Predictor
from ..identify.prepared_recording import Prepared, prepare
from ..identify.residuals import Residuals
from ..least_squares import (
    SAME_START,
    BoundsAndPrior,
    Descended,
    bounds_and_prior,
    cost_of,
    levenberg_marquardt,
    normal_equations,
)
from ..progress import StoppedError
from ..recording.decimation import first_part

TOLERANCE = 1e-14
"""Relative; the cost of noise-free data decreases by twenty orders of magnitude."""


@dataclass(frozen=True)
class RefinedFit:
    """End of a descent."""

    vector: np.ndarray
    cost: float
    """Sum of weighted squares, without the priors."""
    gradient: float
    """|J'r| of the scaled problem over |J||r|: the cosine of residual and sensitivities."""
    converged: bool
    stopped_before_first_step: bool = False
    """Whether it was stopped before the first step was done."""
    slopes: tuple[np.ndarray, ...] = ()
    """Sensitivities (M, k, P) there, if the last step computed them."""


ROUNDS_WITH_PRIOR = 3
"""The noise level that scales the prior converges in two rounds; the third confirms."""


OnStep = Callable[[float], bool]
"""Called with the cost after each step; True ends the descent where it is."""


def refine(
    residuals: Residuals, start: np.ndarray, on_step: OnStep, tolerance: float = TOLERANCE
) -> RefinedFit:
    """The least-squares minimum from `start` (P,) within the bounds; `tolerance`: a share of the
    cost, by default as strict as is useful."""
    limits = bounds_and_prior(residuals.unknowns.parameters)
    vector = np.asarray(start, dtype=float)
    watched = _WatchedResiduals(residuals, on_step, vector)
    for _ in range(ROUNDS_WITH_PRIOR if _has_prior(limits) else 1):
        try:
            descended = levenberg_marquardt(
                watched.errors, watched.slopes, vector, scaled_limits(residuals, vector, limits),
                watched.stopped, good_enough=0.0, share=tolerance,
            )  # fmt: skip
        except StoppedError:
            return RefinedFit(watched.vector, watched.cost, np.nan, False, watched.cost == np.inf)
        vector = descended.vector
    return fit_at(residuals, descended)


def _has_prior(limits: BoundsAndPrior) -> bool:
    return bool(np.isfinite(limits.deviations).any())


def scaled_limits(
    residuals: Residuals, vector: np.ndarray, limits: BoundsAndPrior
) -> BoundsAndPrior:
    """The limits, with a prior's standard deviations in units of the residuals at `vector` (P,)."""
    if not _has_prior(limits):
        return limits
    level = float(np.sqrt(np.mean(residuals(vector) ** 2)))
    return replace(limits, deviations=limits.deviations / (level or 1.0))


def fit_at(residuals: Residuals, descended: Descended) -> RefinedFit:
    """The fit at the end of a descent."""
    A, b = normal_equations(descended.blocks, descended.slopes)
    scales = residuals.scales
    size = np.sqrt(np.diag(A) @ scales**2 * cost_of(descended.blocks))
    gradient = float(np.linalg.norm(b * scales) / size) if size > 0.0 else 0.0
    return RefinedFit(descended.vector, descended.cost, gradient, descended.ended)


@dataclass
class _WatchedResiduals:
    """Residuals and slopes for a descent, and its best point so far."""

    residuals: Residuals
    on_step: OnStep
    vector: np.ndarray
    cost: float = np.inf

    def errors(self, x: np.ndarray) -> list[np.ndarray]:
        blocks = self.residuals.blocks(x)
        cost = cost_of(blocks)
        if cost < self.cost:
            self.vector, self.cost = np.array(x), cost
            self.residuals.report(self.vector, cost)
        return blocks

    def slopes(self, x: np.ndarray) -> list[np.ndarray]:
        expensive = self.residuals.predictor.simulation_is_expensive
        return self.residuals.slopes(x, central=not expensive)

    def stopped(self) -> bool:
        return self.on_step(self.cost)


HORIZONS = (1 / 16, 1 / 8, 1 / 4, 1 / 2)
"""Shares of each recording. A stiffness error of 30 % puts a vibration out of phase after three
periods; recordings have some dozens."""

FEWEST_PER_UNKNOWN = 8
"""Counted samples per unknown, below which a first part is too short."""

HORIZON_TOLERANCE = 1e-2
"""Relative cost reduction at which a descent ends before the next, longer one."""


def starts_over_horizon(
    residuals: Residuals, starts: Sequence[np.ndarray], on_step: OnStep
) -> list[np.ndarray]:
    """The starts (P,) of descents over whole recordings, from descents over growing first parts.

    Starts that meet over one part go on as one. A descent goes on from its start where that
    fits the next part better: what a model lacks may take the descent over a short part anywhere.
    """
    vectors = list(starts)
    if all(e.model.arm.coordinates == e.model.arm.joints for e in residuals.experiments):
        return vectors  # what does not swing does not run out of step
    for share in HORIZONS:
        parts = first_parts(residuals.experiments, share)
        counted = sum(int(e.counted.sum()) for e in parts)
        if counted < FEWEST_PER_UNKNOWN * len(residuals.unknowns):
            continue
        shorter, ends = _with_experiments(residuals, parts), dict[int, np.ndarray]()
        vectors = _better_of_each(shorter, vectors, starts)
        shorter = with_enough_steps(shorter, vectors[0])
        for vector in vectors:
            if id(vector) not in ends:
                ends[id(vector)] = _descended(shorter, vector, tuple(ends.values()), on_step)
        vectors = [ends[id(vector)] for vector in vectors]
    return _better_of_each(residuals, vectors, starts)


def _better_of_each(
    residuals: Residuals, ends: Sequence[np.ndarray], starts: Sequence[np.ndarray]
) -> list[np.ndarray]:
    """The vector (P,) of each pair that leaves less error."""
    distinct = list({id(x): x for x in (*ends, *starts)}.values())
    found = residuals.costs(np.array(distinct))
    costs = {id(x): c if np.isfinite(c) else np.inf for x, c in zip(distinct, found, strict=True)}
    pairs = zip(ends, starts, strict=True)
    return [start if costs[id(start)] < costs[id(end)] else end for end, start in pairs]


def _descended(
    residuals: Residuals, start: np.ndarray, others: Sequence[np.ndarray], on_step: OnStep
) -> np.ndarray:
    """The end of a rough descent, or the one of the others that it meets."""
    fit = refine(residuals, start, on_step, HORIZON_TOLERANCE)
    if fit.stopped_before_first_step or not np.isfinite(fit.cost):
        return start
    near = SAME_START * residuals.scales
    return next((x for x in others if np.all(np.abs(x - fit.vector) < near)), fit.vector)


SEARCH_SAMPLES = 30_000
"""Samples of all recordings together for a population search of a few seconds; longer recordings
are shortened to their first parts."""


def first_samples_of(residuals: Residuals, most: int) -> Residuals:
    """The residuals over the recordings' first parts, with `most` samples of all together."""
    samples = sum(len(e.recording.time) for e in residuals.experiments)
    parts = first_parts(residuals.experiments, most / samples) if samples > most else []
    return _with_experiments(residuals, parts) if parts else residuals


def _with_experiments(residuals: Residuals, experiments: Sequence[Prepared]) -> Residuals:
    """The residuals of other experiments."""
    old = residuals.predictor
    predictor = Predictor(experiments, old.unknowns, old.fixed, steps=old.steps)
    return Residuals(predictor, residuals.weights, on_better=residuals.on_better)


def first_parts(experiments: Sequence[Prepared], share: float) -> list[Prepared]:
    """The first `share` of each recording, prepared; empty if nothing of one counts."""
    parts = []
    for e in experiments:
        part = first_part(e.recording, int(np.ceil(share * len(e.recording.time))))
        try:
            parts.append(prepare(e.model, part, e.outputs, e.processing))
        except InputError:
            return []
    return parts
