"""Where a fit begins: from the nominal values, from points around them, from a search's best."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import scipy

from core.identify.estimates import first_estimate
from core.identify.evolution import Searched, evolve
from core.identify.population import PopulationCost
from core.identify.refinement import Refined, refine
from core.identify.residuals import Residuals
from core.least_squares import limits_of
from core.progress import Progress
from core.results import Generation
from core.scenario.schema import IdentifySpec

AGREEMENT = 1e-3
"""Two starts agree when their costs differ by less than this share."""

ROUGH = 1e-6
"""Relative tolerance of the cost in a search whose last step follows: with 10,000 samples a tenth
of a deviation."""

MEETING = AGREEMENT
"""A second descent that is so near to the first one's cost has found the same minimum."""

ROUNDING = 1e-18
"""Of the outputs' sum of squares: below this two costs are both zero."""


def search(
    label: str,
    residuals: Residuals,
    cost: Callable[[np.ndarray], np.ndarray],
    start: np.ndarray,
    spec: IdentifySpec,
    progress: Progress,
) -> Searched | None:
    """Evolution over the searched entries by the cost (S,) of vectors (S, P); the rest keep their
    start."""
    items = residuals.unknowns.items
    free = np.array([i for i, item in enumerate(items) if item.searched], dtype=int)
    if not spec.generations or not len(free):
        return None
    parameters = residuals.unknowns.parameters
    limits = limits_of(parameters)

    def costs(points: np.ndarray) -> np.ndarray:
        vectors = np.tile(start, (len(points), 1))
        vectors[:, free] = points
        # With noise of unknown level the likelihood is N log V.
        return np.asarray(cost(vectors) * np.exp(limits.surprise(vectors) / residuals.count))

    def report(generation: Generation) -> bool:
        progress.generation(label, generation)
        progress.advance()
        return progress.stopped()

    found = evolve(
        costs, parameters.lower()[free], parameters.upper()[free], spec.population,
        spec.generations, spec.seed, report,
    )  # fmt: skip
    vector = start.copy()
    vector[free] = found.vector
    return Searched(vector, found.cost, found.generations, found.stopped)


def evolves(fast: PopulationCost | None, spec: IdentifySpec) -> bool:
    """Whether differential evolution searches: where the scenario asks for its generations, and
    where the whole population costs next to nothing. Elsewhere several starts of a Gauss-Newton
    descent find the same minimum with a hundredth of the simulations."""
    if "generations" in spec.model_fields_set:
        return spec.generations > 0
    return fast is not None


STARTS = 8
"""Points spread over the bounds, of which the best begins a descent beside the nominal values."""

SPREAD = 4.0
"""Factor by which a positive parameter's start differs from its nominal value at most: nominal
stiffnesses were off by as much on benches."""


def several_starts(residuals: Residuals, start: np.ndarray, spec: IdentifySpec) -> list[np.ndarray]:
    """The nominal vector, and the best of some that are spread around it within the bounds."""
    items = residuals.unknowns.items
    moved = [
        i for i, u in enumerate(items) if u.searched and u.parameter.positive and start[i] > 0.0
    ]
    if not moved or not spec.refine or spec.generations == 0:
        return [start]
    points = scipy.stats.qmc.LatinHypercube(
        len(moved), rng=np.random.default_rng(spec.seed)
    ).random(STARTS)
    tried = np.tile(start, (STARTS, 1))
    tried[:, moved] *= SPREAD ** (2.0 * points - 1.0)
    p = residuals.unknowns.parameters
    tried = np.clip(tried, p.lower(), p.upper())
    predictor = residuals.predictor
    steps, predictor.steps = predictor.steps, 1  # which is best, few steps show as well
    costs = residuals.costs(tried)
    predictor.steps = steps
    return [start, tried[int(np.nanargmin(np.where(np.isfinite(costs), costs, np.inf)))]]


def refine_from_all(
    residuals: Residuals, starts: Sequence[np.ndarray], searched: bool, progress: Progress
) -> tuple[Refined, str]:
    """Refines from each start, the first one's minimum first; says whether they agree."""

    def report(cost: float) -> bool:
        progress.advance(0, f"refining, cost {cost:.4g}")
        return progress.stopped()

    dear = residuals.predictor.simulation_is_dear
    tolerance = ROUGH if dear else None
    first = refine(residuals, starts[0], report, tolerance)
    if all(np.array_equal(starts[0], other) for other in starts[1:]):
        return first, "One start: the nominal values."
    if progress.stopped():
        return first, ""
    progress.advance(0, first_estimate(residuals.unknowns, first.vector))

    def meets(cost: float) -> bool:
        near = cost - first.cost <= MEETING * first.cost + ROUNDING * residuals.magnitude
        return report(cost) or (dear and near)

    second = refine(residuals, starts[1], meets, tolerance)
    if not np.isfinite(second.cost):  # stopped in its first step
        return first, ""
    low, high = sorted((first.cost, second.cost))
    agree = high - low <= AGREEMENT * low + ROUNDING * residuals.magnitude
    names = "the search's best and the nominal values" if searched else (
        f"the nominal values and the best of {STARTS} points around them"
    )  # fmt: skip
    sentence = (
        f"Both starts, {names}, end at the same cost."
        if agree
        else f"The two starts end at different costs, {low:.4g} and {high:.4g}; the lower is kept."
    )
    # Where both agree the search decides: the nominal start would flatter itself in a valley.
    return (first if agree or first.cost <= second.cost else second), sentence
