"""One identification: search, refinement, uncertainty, identifiability."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from core.identify import identifiability
from core.identify.derived import derived_estimates
from core.identify.evolution import Searched, evolve
from core.identify.population import PopulationCost
from core.identify.predictor import Predictor
from core.identify.prepared import Prepared
from core.identify.refinement import Prior, Refined, refine
from core.identify.residuals import Residuals, channel_weights
from core.identify.uncertainty import covariance
from core.identify.unknowns import Unknowns
from core.progress import Progress
from core.results import Estimate, Fit, Generation
from core.scenario.schema import IdentifySpec

AGREEMENT = 1e-3
"""Two starts agree when their costs differ by less than this share."""

ROUNDING = 1e-18
"""Of the outputs' sum of squares: below this two costs are both zero."""

UNSEEN = 1e-12
"""Of the outputs' sum of squares: a cost that no measurement shows. A valley's direction is
good to 1e-8, so that without noise its cost would rise, from nothing to next to nothing."""

AT_BOUND = 1e-6
"""Of the distance between the bounds."""


@dataclass(frozen=True)
class Fitted:
    """A fit and what is needed to predict with it."""

    fit: Fit
    vector: np.ndarray
    residuals: Residuals


def identify(
    label: str,
    experiments: Sequence[Prepared],
    unknowns: Unknowns,
    spec: IdentifySpec,
    fixed: Mapping[str, float],
    progress: Progress,
) -> Fitted:
    """Minimises (13) over the experiments and says how sure the result is."""
    predictor = Predictor(experiments, unknowns, fixed)
    residuals = Residuals(predictor, channel_weights(experiments, spec.weights))
    start = unknowns.parameters.vector()
    predictor.settle(start)
    searched, fast = None, residuals.population()
    if evolves(fast, spec):
        searched = _search(
            label, residuals, residuals.costs if fast is None else fast, start, spec, progress
        )
        starts = [start if searched is None else searched.vector, start]
    else:
        starts = several_starts(residuals, start, spec)
    stopped = (searched is not None and searched.stopped) or progress.stopped()
    if not len(unknowns) or stopped or not spec.refine:
        best = starts[0]
        refined = Refined(best, float(np.sum(residuals(best) ** 2)), np.nan, False)
        agreement = ""
    else:
        refined, agreement = _refine_from_all(residuals, starts, searched is not None, progress)
        if predictor.simulation_is_dear and not progress.stopped():
            predictor.settle(refined.vector)
            refined = refine(residuals, refined.vector, lambda _: progress.stopped())
        stopped = progress.stopped()
    history = searched.generations if searched is not None else ()
    fit = _describe(label, residuals, refined, history, agreement, stopped)
    return Fitted(fit, refined.vector, residuals)


def _search(
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
    prior = Prior(residuals)

    def costs(points: np.ndarray) -> np.ndarray:
        vectors = np.tile(start, (len(points), 1))
        vectors[:, free] = points
        return np.asarray(cost(vectors) * prior.factor(vectors))

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
    points = qmc.LatinHypercube(len(moved), rng=np.random.default_rng(spec.seed)).random(STARTS)
    tried = np.tile(start, (STARTS, 1))
    tried[:, moved] *= SPREAD ** (2.0 * points - 1.0)
    p = residuals.unknowns.parameters
    tried = np.clip(tried, p.lower(), p.upper())
    costs = residuals.costs(tried)
    return [start, tried[int(np.nanargmin(np.where(np.isfinite(costs), costs, np.inf)))]]


def _refine_from_all(
    residuals: Residuals, starts: Sequence[np.ndarray], searched: bool, progress: Progress
) -> tuple[Refined, str]:
    """Refines from each start, the first one's minimum first; says whether they agree."""

    def report(cost: float) -> bool:
        progress.advance(0, f"refining, cost {cost:.4g}")
        return progress.stopped()

    first = refine(residuals, starts[0], report)
    if all(np.array_equal(starts[0], other) for other in starts[1:]):
        return first, "One start: the nominal values."
    if progress.stopped():
        return first, ""
    second = refine(residuals, starts[1], report)
    low, high = sorted((first.cost, second.cost))
    agree = high - low <= AGREEMENT * low + ROUNDING * _size(residuals)
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


def _size(residuals: Residuals) -> float:
    """Sum of squares of the weighted outputs."""
    pairs = zip(residuals.experiments, residuals.weights, strict=True)
    return sum(float(np.sum((e.measured * w)[e.counted] ** 2)) for e, w in pairs)


def _describe(
    label: str,
    residuals: Residuals,
    refined: Refined,
    history: tuple[Generation, ...],
    agreement: str,
    stopped: bool,
) -> Fit:
    unknowns, vector = residuals.unknowns, refined.vector
    recordings = tuple(e.recording.name for e in residuals.experiments)
    P = len(unknowns)
    blocks = residuals.blocks(vector)
    sensitivities = residuals.sensitivities(vector)
    jacobian = residuals.vector(sensitivities) if P else np.zeros((1, 0))
    rank, _, null = (
        identifiability.analyse(unknowns, vector, jacobian) if P else (0, None, np.zeros((0, 0)))
    )
    cov = covariance(sensitivities, blocks, rank) if P else np.zeros((0, 0))
    seen = identifiability.identified(null, P) if P else np.zeros(0, dtype=bool)
    correlation = _correlation(cov)
    fast, floor = residuals.population(vector), UNSEEN * _size(residuals)

    def cost(v: np.ndarray) -> float:
        found = residuals.costs(v[None]) if fast is None else fast(v[None])
        return floor + float(found[0])

    return Fit(
        label=label,
        recordings=recordings,
        estimates=_estimates(unknowns, vector, cov, seen),
        correlation=correlation,
        cost=refined.cost,
        residual_count=residuals.count,
        convergence=history,
        identifiability=identifiability.verdict(unknowns, vector, jacobian, correlation, cost),
        gradient_norm=refined.gradient,
        message=agreement,
        stopped=stopped,
        derived=derived_estimates(residuals.experiments[0].model, unknowns, vector, cov, null),
    )


def _estimates(
    unknowns: Unknowns, vector: np.ndarray, cov: np.ndarray, seen: np.ndarray
) -> tuple[Estimate, ...]:
    found = []
    for i, item in enumerate(unknowns.items):
        p = item.parameter
        near = AT_BOUND * (p.upper - p.lower)
        value = float(vector[i])
        found.append(
            Estimate(
                name=p.name,
                value=value,
                std=float(np.sqrt(max(cov[i, i], 0.0))) if seen[i] else float("nan"),
                unit=p.unit,
                identifiable=bool(seen[i]),
                symbol=p.symbol,
                start=p.value,
                lower=p.lower,
                upper=p.upper,
                recording=item.recording,
                at_bound=bool(value - p.lower < near or p.upper - value < near),
            )
        )
    return tuple(found)


def _correlation(cov: np.ndarray) -> np.ndarray:
    d = np.sqrt(np.maximum(np.diag(cov), 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        rho = cov / np.outer(d, d)
    return np.nan_to_num(rho)
