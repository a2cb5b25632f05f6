"""One identification: search, refinement, uncertainty, identifiability."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from scipy.stats import qmc

from core.errors import InputError
from core.identify import identifiability
from core.identify.derived import derived_estimates
from core.identify.evolution import Searched, evolve
from core.identify.growing import grown
from core.identify.polish import polished
from core.identify.population import PopulationCost
from core.identify.predictor import Predictor
from core.identify.prepared import Prepared
from core.identify.refinement import OnStep, Prior, Refined, refine
from core.identify.residuals import Residuals, channel_weights
from core.identify.shortened import is_long, shortened
from core.identify.uncertainty import covariance
from core.identify.unknowns import Unknowns
from core.progress import Progress, StoppedError, heeding
from core.results import Estimate, Fit, Generation
from core.scenario.schema import IdentifySpec
from core.written import format_number, with_unit

T = TypeVar("T")

AGREEMENT = 1e-3
"""Two starts agree when their costs differ by less than this share."""

ROUGH = 1e-6
"""Relative tolerance of the cost in a search whose last step follows: with 10,000 samples a tenth
of a deviation."""

MEETING = AGREEMENT
"""A second descent that is so near to the first one's cost has found the same minimum."""

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
    """Over the recordings as the fit saw them: a search that was stopped may have seen less than
    there is."""
    notes: tuple[str, ...] = ()
    """What is to be said about how it was found."""


def identify(
    label: str,
    experiments: Sequence[Prepared],
    unknowns: Unknowns,
    spec: IdentifySpec,
    fixed: Mapping[str, float],
    progress: Progress,
) -> Fitted:
    """Minimises (13) over the experiments and says how sure the result is.

    Long recordings are searched with fewer samples; the last refinement takes them all, unless
    somebody stops it before its first step.
    """
    with heeding(progress):
        found = _stoppable(lambda: _found(label, experiments, unknowns, spec, fixed, progress))
    if found is None:
        if is_long(experiments):
            raise InputError(f"Stopped before there was a first estimate of {label}.")
        residuals = _residuals(experiments, unknowns, spec, fixed)
        found = _Found(residuals, _unrefined(unknowns.parameters.vector()), (), "", True)
    fit = _describe(label, found)
    return Fitted(fit, found.refined.vector, found.residuals, found.notes)


@dataclass(frozen=True)
class _Found:
    """Where a search, or a search and the refinement after it, ended."""

    residuals: Residuals
    refined: Refined
    history: tuple[Generation, ...]
    agreement: str
    stopped: bool
    notes: tuple[str, ...] = ()


def _unrefined(vector: np.ndarray) -> Refined:
    return Refined(vector, float("nan"), float("nan"), False)


def _stoppable(work: Callable[[], T]) -> T | None:
    """What the work gives; None where somebody stopped it."""
    try:
        return work()
    except StoppedError:
        return None


def _residuals(
    experiments: Sequence[Prepared],
    unknowns: Unknowns,
    spec: IdentifySpec,
    fixed: Mapping[str, float],
) -> Residuals:
    predictor = Predictor(experiments, unknowns, fixed)
    return Residuals(predictor, channel_weights(experiments, spec.weights))


def _found(
    label: str,
    experiments: Sequence[Prepared],
    unknowns: Unknowns,
    spec: IdentifySpec,
    fixed: Mapping[str, float],
    progress: Progress,
) -> _Found:
    """Searched with few samples where there are many, refined with all."""
    short = shortened(experiments, unknowns, fixed) if len(unknowns) and spec.refine else None
    if short is None:
        return _searched(label, _residuals(experiments, unknowns, spec, fixed), spec, progress)
    progress.advance(0, short.sentence)
    first = _searched(label, _residuals(short.experiments, unknowns, spec, fixed), spec, progress)
    if first.stopped:
        return replace(first, notes=(STOPPED_EARLY, short.note))
    message = first_estimate(unknowns, first.refined.vector)
    progress.advance(0, f"{message}; refining with all samples")
    residuals = _residuals(experiments, unknowns, spec, fixed)
    short.hand_on_steps(first.residuals.predictor, residuals.predictor)
    last = _stoppable(lambda: _refined_from(residuals, first.refined.vector, message, progress))
    if last is None:
        return replace(first, stopped=True, notes=(STOPPED_EARLY, short.note))
    if progress.stopped():  # nobody waits for what all samples say about it
        at = _unrefined(last.vector)
        return replace(first, refined=at, stopped=True, notes=(STOPPED_LATE, short.note))
    return replace(first, residuals=residuals, refined=last, notes=(short.note,))


STOPPED_EARLY = (
    "Stopped before the refinement with all samples had begun: what is shown is from the samples "
    "that the search worked on."
)
STOPPED_LATE = (
    "Stopped in the refinement with all samples: deviations and errors are those on the samples "
    "that the search worked on."
)


def first_estimate(unknowns: Unknowns, vector: np.ndarray) -> str:
    """What a search with few samples found, in words."""
    pairs = zip(unknowns.items, vector, strict=True)
    shown = [
        f"{item.label} = {with_unit(format_number(float(value)), item.parameter.unit)}"
        for item, value in pairs if item.searched
    ]  # fmt: skip
    more = f" and {len(shown) - SHOWN} more" if len(shown) > SHOWN else ""
    return f"first estimate: {', '.join(shown[:SHOWN])}{more}"


SHOWN = 4
"""Parameters of a first estimate that find room in a line."""


def _refined_from(
    residuals: Residuals, vector: np.ndarray, message: str, progress: Progress
) -> Refined:
    """The minimum with all samples, from that with few."""

    def report(cost: float) -> bool:
        progress.advance(0, f"{message}; refining with all samples, cost {cost:.4g}")
        return progress.stopped()

    if residuals.predictor.simulation_is_dear:
        return _with_exact_steps(residuals, _unrefined(vector), report)
    refined = refine(residuals, vector, report)
    if refined.stopped_at_once:
        raise StoppedError
    return refined


def _with_exact_steps(residuals: Residuals, refined: Refined, report: OnStep) -> Refined:
    """The minimum without the error of few steps: one step of Gauss and Newton away or, where
    that is too far, at the end of a descent."""
    predictor = residuals.predictor
    found = polished(residuals, refined)
    if found is None and not report(refined.cost):
        descended = refine(residuals, refined.vector, report)
        if descended.stopped_at_once:
            raise StoppedError
        found = polished(residuals, descended) or descended
    assert predictor.steps is not None
    return refined if found is None else found


def _searched(label: str, residuals: Residuals, spec: IdentifySpec, progress: Progress) -> _Found:
    """Search and refinement over the residuals' experiments."""
    predictor, unknowns = residuals.predictor, residuals.unknowns
    start = unknowns.parameters.vector()
    if predictor.simulation_is_dear:
        predictor.coarsen(start)
    searched, fast = None, residuals.population()
    if evolves(fast, spec):
        searched = _search(
            label, residuals, residuals.costs if fast is None else fast, start, spec, progress
        )
        starts = [start if searched is None else searched.vector, start]
    else:
        starts = several_starts(residuals, start, spec)
    if predictor.simulation_is_dear and spec.refine and len(unknowns):
        starts = [grown(residuals, one, lambda _: progress.stopped()) for one in starts]
    stopped = (searched is not None and searched.stopped) or progress.stopped()
    if not len(unknowns) or stopped or not spec.refine:
        best = starts[0]
        with heeding(None):
            cost = float(np.sum(residuals(best) ** 2))
        refined, agreement = Refined(best, cost, np.nan, False), ""
    else:
        refined, agreement = _refine_from_all(residuals, starts, searched is not None, progress)
        if predictor.simulation_is_dear and not progress.stopped():
            rough = refined
            exact = _stoppable(
                lambda: _with_exact_steps(residuals, rough, lambda _: progress.stopped())
            )
            refined = rough if exact is None else exact
        stopped = progress.stopped()
    history = searched.generations if searched is not None else ()
    return _Found(residuals, refined, history, agreement, stopped)


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
    predictor = residuals.predictor
    steps, predictor.steps = predictor.steps, 1  # which is best, few steps show as well
    costs = residuals.costs(tried)
    predictor.steps = steps
    return [start, tried[int(np.nanargmin(np.where(np.isfinite(costs), costs, np.inf)))]]


def _refine_from_all(
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
        near = cost - first.cost <= MEETING * first.cost + ROUNDING * _size(residuals)
        return report(cost) or (dear and near)

    second = refine(residuals, starts[1], meets, tolerance)
    if not np.isfinite(second.cost):  # stopped in its first step
        return first, ""
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


def _describe(label: str, found: _Found) -> Fit:
    residuals, refined = found.residuals, found.refined
    unknowns, vector = residuals.unknowns, refined.vector
    recordings = tuple(e.recording.name for e in residuals.experiments)
    P = len(unknowns)
    blocks = residuals.blocks(vector)
    sensitivities = list(refined.slopes) or residuals.sensitivities(vector)
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
        cost=refined.cost if np.isfinite(refined.cost) else _sum_of_squares(blocks),
        residual_count=residuals.count,
        convergence=found.history,
        identifiability=identifiability.verdict(unknowns, vector, jacobian, correlation, cost),
        gradient_norm=refined.gradient,
        message=found.agreement,
        stopped=found.stopped,
        derived=derived_estimates(residuals.experiments[0].model, unknowns, vector, cov, null),
    )


def _sum_of_squares(blocks: Sequence[np.ndarray]) -> float:
    return sum(float(np.sum(b * b)) for b in blocks)


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
