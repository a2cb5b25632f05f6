"""One identification: search, refinement, uncertainty, identifiability."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple, TypeVar

import numpy as np

from ..drives.servo import FollowingServo
from ..identify.defect_correction import corrected_minimum, with_enough_steps
from ..identify.estimates import SearchResult, summarise_fit
from ..identify.fit_starts import refine_from_starts, search, several_starts, uses_evolution
from ..identify.loop_rate import better_loop, with_faster_loop, with_servo
from ..identify.predictor import Predictor
from ..identify.prepared_recording import Prepared, for_model
from ..identify.refinement import (
    SEARCH_SAMPLES,
    RefinedFit,
    first_samples_of,
    fit_at,
    scaled_limits,
    starts_over_horizon,
)
from ..identify.residuals import Residuals, channel_weights
from ..identify.unknowns import Unknowns
from ..least_squares import bounds_and_prior, cost_of
from ..progress import Progress, StoppedError, use_progress
from ..results import Fit
from ..scenario.schema import IdentifySpec

T = TypeVar("T")


@dataclass(frozen=True)
class Fitted:
    """A fit, its vector and its residuals."""

    fit: Fit
    vector: np.ndarray
    residuals: Residuals


def identify(
    label: str, experiments: Sequence[Prepared], unknowns: Unknowns, spec: IdentifySpec,
    fixed: Mapping[str, float], progress: Progress,
) -> Fitted:  # fmt: skip
    """Minimise (13) over the experiments and estimate the uncertainty. If stopped, the best so
    far is described."""
    models = {id(e.model): with_faster_loop(e.model) for e in experiments}
    experiments = [for_model(e, models[id(e.model)]) for e in experiments]
    start, predictor = unknowns.parameters.vector(), Predictor(experiments, unknowns, fixed)
    if predictor.simulation_is_expensive:
        predictor = predictor.with_steps(1)
    residuals = Residuals(
        predictor, channel_weights(experiments, spec.weights),
        on_better=partial(progress.better, label),
    )  # fmt: skip
    with use_progress(progress):
        result = _stoppable(lambda: _searched(label, residuals, spec, progress))
    if result is None:
        result = SearchResult(residuals, RefinedFit(start, np.nan, np.nan, False), (), "", True)
    return Fitted(summarise_fit(label, result), result.refined.vector, result.residuals)


def _stoppable(work: Callable[[], T]) -> T | None:
    """Result of the work; None if it was stopped."""
    try:
        return work()
    except StoppedError:
        return None


def _with_corrected_steps(
    residuals: Residuals, rough: RefinedFit, stopped: Callable[[], bool]
) -> tuple[Residuals, RefinedFit]:
    """The minimum without step error, and its residuals."""
    vector = rough.vector
    limits = scaled_limits(residuals, vector, bounds_and_prior(residuals.unknowns.parameters))
    slopes = residuals.slopes(vector, central=False)
    fine, descended = corrected_minimum(residuals, vector, slopes, limits, stopped)
    if not np.isfinite(descended.cost):
        return residuals, rough
    return fine, replace(fit_at(fine, descended), slopes=descended.slopes)


class Minimum(NamedTuple):
    """Where descents from several starts ended."""

    residuals: Residuals
    """In steps that are fine enough, for the rate of the rig's loop that leaves less error."""
    fit: RefinedFit
    servo: FollowingServo | None
    """With another rate of the loop, where that leaves less error."""
    agreement: str
    """Whether the starts agree, as a sentence."""


def minimum_from_starts(
    residuals: Residuals, starts: Sequence[np.ndarray], searched: bool, progress: Progress
) -> Minimum:
    """The minimum that the best of the starts (P,) leads to, the first one first. `searched`: the
    first start is the end of a search."""
    expensive = residuals.predictor.simulation_is_expensive
    if expensive:
        residuals = _stoppable(partial(with_enough_steps, residuals, starts[0])) or residuals
    fit, agreement = refine_from_starts(residuals, starts, searched, progress)
    servo = None
    if expensive and not progress.stopped():
        servo = _stoppable(partial(better_loop, residuals, fit.vector))
    if servo is not None:
        other = with_servo(residuals, servo)
        again = refine_from_starts(other, [fit.vector], False, progress)[0]
        if again.cost < fit.cost:
            return Minimum(other, again, servo, agreement)
    return Minimum(residuals, fit, None, agreement)


def _searched(
    label: str, residuals: Residuals, spec: IdentifySpec, progress: Progress
) -> SearchResult:
    """Search and refinement over the residuals' experiments."""
    predictor, unknowns = residuals.predictor, residuals.unknowns
    start = unknowns.parameters.vector()
    expensive = predictor.simulation_is_expensive
    short = first_samples_of(residuals, SEARCH_SAMPLES)
    searched, fast = None, short.population()
    if uses_evolution(fast, spec):
        short = with_enough_steps(short, start) if expensive else short
        searched = search(label, short, fast or short.costs, start, spec, progress)
        starts = [start if searched is None else searched.vector, start]
    else:
        starts = several_starts(residuals, start, spec)
    history = searched.generations if searched is not None else ()
    stopped = (searched is not None and searched.stopped) or progress.stopped()
    if not len(unknowns) or stopped or not spec.refine:
        residuals, fit = _without_descent(residuals, starts[0], expensive and not stopped)
        return SearchResult(residuals, fit, history, "", stopped)
    if expensive:
        progress.advance(0, "starting with the first vibrations of each recording")
        nearer = partial(starts_over_horizon, residuals, starts, lambda _: progress.stopped())
        starts = _stoppable(nearer) or starts
    end = minimum_from_starts(residuals, starts, searched is not None, progress)
    residuals, fit = end.residuals, end.fit
    if expensive and not progress.stopped():
        exact = _stoppable(lambda: _with_corrected_steps(residuals, fit, progress.stopped))
        residuals, fit = exact or (residuals, fit)
    return SearchResult(residuals, fit, history, end.agreement, progress.stopped())


def _without_descent(
    residuals: Residuals, vector: np.ndarray, expensive: bool
) -> tuple[Residuals, RefinedFit]:
    """The fit at a vector (P,), which is not refined."""
    with use_progress(None):
        if expensive:
            residuals = with_enough_steps(residuals, vector)
            servo = better_loop(residuals, vector)
            # Nothing follows here: what the other rate leaves at the vector itself decides.
            others = [] if servo is None else [with_servo(residuals, servo)]
            residuals = min([residuals, *others], key=lambda r: cost_of(r.blocks(vector)))
        cost = float(np.sum(residuals(vector) ** 2))
    return residuals, RefinedFit(vector, cost, np.nan, False)
