"""Starts of a fit: nominal values, points around them (a Latin hypercube: McKay, Beckman and
Conover 1979), the best of a search (differential evolution: Storn and Price 1997)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from ..identify.defect_correction import with_steps
from ..identify.estimates import first_estimate_text
from ..identify.population_cost import PopulationCost
from ..identify.refinement import TOLERANCE, RefinedFit, refine
from ..identify.residuals import Residuals
from ..identify.unknown_gains import with_best_gains
from ..least_squares import bounds_and_prior
from ..progress import Progress, StoppedError
from ..results import Generation
from ..scenario.schema import IdentifySpec

DIFFERENTIAL_WEIGHT = 0.8
"""F of design section 2."""
CROSSOVER = 0.9
"""CR of design section 2."""

FAILED_COST = float(np.sqrt(np.finfo(float).max))
"""Cost of a vector whose simulation overflowed; finite, so that it can be ranked."""

OnGeneration = Callable[[Generation], bool]
"""Called after each generation; True stops the search."""


@dataclass(frozen=True)
class EvolutionResult:
    """End of the search, and its history."""

    vector: np.ndarray
    cost: float
    generations: tuple[Generation, ...]
    stopped: bool


def first_population(
    lower: np.ndarray, upper: np.ndarray, members: int, rng: np.random.Generator
) -> np.ndarray:
    """(members, P), uniform in the bounds `lower` and `upper` (P,)."""
    return np.asarray(lower + (upper - lower) * rng.random((members, len(lower))))


def evolve(
    costs: Callable[[np.ndarray], np.ndarray], lower: np.ndarray, upper: np.ndarray, members: int,
    generations: int, seed: int, on_generation: OnGeneration,
) -> EvolutionResult:  # fmt: skip
    """rand/1/bin over `generations` between `lower` and `upper` (P,); `costs` takes (S, P) and
    gives (S,). If stopped within a generation, the best of those before is kept; StoppedError if
    there is none."""
    rng = np.random.default_rng(seed)
    history: list[Generation] = []
    stopped = False

    def evaluate(x: np.ndarray) -> np.ndarray:
        try:
            values = costs(np.atleast_2d(x.T))
        except StoppedError:
            return np.full(x.size // len(lower), FAILED_COST)
        return np.where(np.isfinite(values), values, FAILED_COST)

    def report(intermediate_result: scipy.optimize.OptimizeResult) -> bool:
        nonlocal stopped
        generation = _generation(len(history) + 1, intermediate_result)
        history.append(generation)
        stopped = on_generation(generation)
        return stopped

    result = scipy.optimize.differential_evolution(
        evaluate, list(zip(lower, upper, strict=True)), strategy="rand1bin", maxiter=generations,
        init=first_population(lower, upper, members, rng), mutation=DIFFERENTIAL_WEIGHT,
        recombination=CROSSOVER, tol=0.0, atol=0.0, polish=False, updating="deferred",
        vectorized=True, callback=report, rng=rng,
    )  # fmt: skip
    if result.fun >= FAILED_COST and stopped:
        raise StoppedError
    return EvolutionResult(np.asarray(result.x), float(result.fun), tuple(history), stopped)


def _generation(number: int, result: scipy.optimize.OptimizeResult) -> Generation:
    energies = np.asarray(result.population_energies)
    return Generation(
        number=number, best=float(energies.min()), mean=float(energies.mean()),
        worst=float(energies.max()), best_vector=np.array(result.x),
        population=np.array(result.population),
    )  # fmt: skip


AGREEMENT = 1e-3
"""Two starts agree if their costs differ by less than this share."""

ROUGH_TOLERANCE = 1e-6
"""Relative tolerance of the cost in a search before the last step: with 10,000 samples a tenth of a
standard deviation."""

MEETING = AGREEMENT
"""A second descent this near to the first one's cost has found the same minimum."""

ROUNDING = 1e-18
"""Of the outputs' sum of squares: below this two costs are both zero."""


def search(
    label: str, residuals: Residuals, cost: Callable[[np.ndarray], np.ndarray], start: np.ndarray,
    spec: IdentifySpec, progress: Progress,
) -> EvolutionResult | None:  # fmt: skip
    """Evolution over the searched entries; `cost` (S,) of vectors (S, P). The others keep their
    `start` (P,)."""
    items = residuals.unknowns.items
    free = np.array([i for i, item in enumerate(items) if item.searched], dtype=int)
    if not spec.generations or not len(free):
        return None
    parameters = residuals.unknowns.parameters
    limits = bounds_and_prior(parameters)

    def costs(points: np.ndarray) -> np.ndarray:
        vectors = np.tile(start, (len(points), 1))
        vectors[:, free] = points
        # With noise of unknown level the likelihood is N log V.
        return np.asarray(cost(vectors) * np.exp(limits.prior_cost(vectors) / residuals.count))

    def report(generation: Generation) -> bool:
        progress.generation(label, generation)
        vector = start.copy()
        vector[free] = generation.best_vector
        residuals.report(vector, generation.best)
        progress.advance()
        return progress.stopped()

    result = evolve(
        costs, parameters.lower()[free], parameters.upper()[free], spec.population,
        spec.generations, spec.seed, report,
    )  # fmt: skip
    vector = start.copy()
    vector[free] = result.vector
    return EvolutionResult(vector, result.cost, result.generations, result.stopped)


def uses_evolution(fast: PopulationCost | None, spec: IdentifySpec) -> bool:
    """Whether differential evolution is used: if the scenario states generations, or if a whole
    population costs next to nothing. Otherwise descents from several starts find the same minimum
    with a hundredth of the simulations."""
    if "generations" in spec.model_fields_set:
        return spec.generations > 0
    return fast is not None and fast.is_cheap


STARTS = 8
"""Points spread over the bounds; a descent starts from the best of them beside the nominal one."""

SPREAD = 4.0
"""Largest factor between a positive parameter's start and its nominal value: nominal stiffnesses
were off by as much."""


def several_starts(residuals: Residuals, start: np.ndarray, spec: IdentifySpec) -> list[np.ndarray]:
    """The nominal vector `start` (P,), and the best of some points around it within the bounds."""
    items = residuals.unknowns.items
    moved = [
        i for i, u in enumerate(items) if u.searched and u.parameter.positive and start[i] > 0.0
    ]
    if not moved or not spec.refine or spec.generations == 0:
        return [start]
    rng = np.random.default_rng(spec.seed)
    cells = rng.permuted(np.tile(np.arange(STARTS), (len(moved), 1)), axis=1).T
    points = (cells + rng.random(cells.shape)) / STARTS  # a Latin hypercube
    tried = np.tile(start, (STARTS, 1))
    tried[:, moved] *= SPREAD ** (2.0 * points - 1.0)
    p = residuals.unknowns.parameters
    rough = with_steps(residuals, 1)  # which is best, few steps show as well
    tried = with_best_gains(rough, np.clip(tried, p.lower(), p.upper()))
    costs = rough.costs(tried)
    return [start, tried[int(np.nanargmin(np.where(np.isfinite(costs), costs, np.inf)))]]


def refine_from_starts(
    residuals: Residuals, starts: Sequence[np.ndarray], searched: bool, progress: Progress
) -> tuple[RefinedFit, str]:
    """Refine from each start, the first one first; the sentence says whether they agree."""

    def report(cost: float) -> bool:
        progress.advance(0, f"refining, cost {cost:.4g}")
        return progress.stopped()

    expensive = residuals.predictor.simulation_is_expensive
    tolerance = ROUGH_TOLERANCE if expensive else TOLERANCE
    names = "the search's best and the nominal values" if searched else (
        f"the nominal values and the best of {STARTS} points around them"
    )  # fmt: skip
    first = refine(residuals, starts[0], report, tolerance)
    if len(starts) == 1:
        return first, "One start: the nominal values."
    if progress.stopped():
        return first, ""
    if np.array_equal(starts[0], starts[1]):
        return first, f"Both starts ({names}) end in the same minimum."
    progress.advance(0, first_estimate_text(residuals.unknowns, first.vector))

    def meets(cost: float) -> bool:
        near = cost - first.cost <= MEETING * first.cost + ROUNDING * residuals.magnitude
        return report(cost) or (expensive and near)

    second = refine(residuals, starts[1], meets, tolerance)
    if not np.isfinite(second.cost):  # stopped in its first step
        return first, ""
    low, high = sorted((first.cost, second.cost))
    agree = high - low <= AGREEMENT * low + ROUNDING * residuals.magnitude
    sentence = (
        f"Both starts ({names}) end at the same cost."
        if agree
        else f"The two starts end at different costs, {low:.4g} and {high:.4g}; the lower is kept."
    )
    # Where both agree the search decides: the nominal start would flatter itself in a valley.
    return (first if agree or first.cost <= second.cost else second), sentence
