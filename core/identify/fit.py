"""One identification: search, refinement, uncertainty, identifiability."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from core.identify.estimates import Found, describe
from core.identify.growing import SEARCHED, first_of, grown
from core.identify.polish import polished
from core.identify.predictor import Predictor
from core.identify.prepared import Prepared
from core.identify.refinement import OnStep, Refined, refine
from core.identify.residuals import Residuals, channel_weights
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


def identify(
    label: str,
    experiments: Sequence[Prepared],
    unknowns: Unknowns,
    spec: IdentifySpec,
    fixed: Mapping[str, float],
    progress: Progress,
) -> Fitted:
    """Minimises (13) over the experiments and says how sure the result is.

    Somebody may stop it at any moment; the best so far is described then.
    """
    residuals = Residuals(
        Predictor(experiments, unknowns, fixed), channel_weights(experiments, spec.weights)
    )
    with heeding(progress):
        found = _stoppable(lambda: _searched(label, residuals, spec, progress))
    if found is None:
        found = Found(residuals, _unrefined(unknowns.parameters.vector()), (), "", True)
    return Fitted(describe(label, found), found.refined.vector, residuals)


def _unrefined(vector: np.ndarray) -> Refined:
    return Refined(vector, float("nan"), float("nan"), False)


def _stoppable(work: Callable[[], T]) -> T | None:
    """What the work gives; None where somebody stopped it."""
    try:
        return work()
    except StoppedError:
        return None


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
    short = first_of(residuals, SEARCHED)
    searched, fast = None, short.population()
    if evolves(fast, spec):
        searched = search(label, short, fast or short.costs, start, spec, progress)
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
