"""One identification: search, refinement, uncertainty, identifiability."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from core.errors import InputError
from core.identify.estimates import Found, describe, first_estimate
from core.identify.growing import grown
from core.identify.polish import polished
from core.identify.predictor import Predictor
from core.identify.prepared import Prepared
from core.identify.refinement import OnStep, Refined, refine
from core.identify.residuals import Residuals, channel_weights
from core.identify.shortened import is_long, shortened
from core.identify.starts import evolves, refine_from_all, search, several_starts
from core.identify.unknowns import Unknowns
from core.progress import Progress, StoppedError, heeding
from core.results import Fit
from core.scenario.schema import IdentifySpec

T = TypeVar("T")


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
        found = Found(residuals, _unrefined(unknowns.parameters.vector()), (), "", True)
    fit = describe(label, found)
    return Fitted(fit, found.refined.vector, found.residuals, found.notes)


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
) -> Found:
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


def _searched(label: str, residuals: Residuals, spec: IdentifySpec, progress: Progress) -> Found:
    """Search and refinement over the residuals' experiments."""
    predictor, unknowns = residuals.predictor, residuals.unknowns
    start = unknowns.parameters.vector()
    if predictor.simulation_is_dear:
        predictor.coarsen(start)
    searched, fast = None, residuals.population()
    if evolves(fast, spec):
        searched = search(
            label, residuals, residuals.costs if fast is None else fast, start, spec, progress
        )
        starts = [start if searched is None else searched.vector, start]
    else:
        starts = several_starts(residuals, start, spec)
    if predictor.simulation_is_dear and spec.refine and len(unknowns):
        progress.advance(0, "beginning with the first swings of each recording")
        starts = [grown(residuals, one, lambda _: progress.stopped()) for one in starts]
    stopped = (searched is not None and searched.stopped) or progress.stopped()
    if not len(unknowns) or stopped or not spec.refine:
        best = starts[0]
        with heeding(None):
            cost = float(np.sum(residuals(best) ** 2))
        refined, agreement = Refined(best, cost, np.nan, False), ""
    else:
        refined, agreement = refine_from_all(residuals, starts, searched is not None, progress)
        if predictor.simulation_is_dear and not progress.stopped():
            rough = refined
            exact = _stoppable(
                lambda: _with_exact_steps(residuals, rough, lambda _: progress.stopped())
            )
            refined = rough if exact is None else exact
        stopped = progress.stopped()
    history = searched.generations if searched is not None else ()
    return Found(residuals, refined, history, agreement, stopped)
