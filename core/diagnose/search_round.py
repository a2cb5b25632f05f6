"""One round of the search: screen the candidates, refit the promising ones, accept one or a set.

Refits whose predicted cost reduction is too small stop after a few iterations (as in successive
halving: Jamieson and Talwalkar 2016). They keep their results, and so their place in the ranking.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass, replace

import numpy as np

from ..diagnose.acceptance import Acceptance
from ..diagnose.evidence import (
    WHOLE_SHARE,
    RefittedCandidate,
    Round,
    assess_refit,
    ranked_candidates,
    share_above_noise,
    unseen_decide,
)
from ..diagnose.judgement import Judge
from ..diagnose.linear_screen import Screen, ScreenedCandidate, screen
from ..diagnose.output_changes import nearer_to_neutral
from ..diagnose.progress_messages import ACCEPTANCE, REFITS, SLOW_REFITS
from ..effects.effect import Effect
from ..estimate.fit_result import (
    FitResult,
    SlopesByLabel,
    best_start,
    fit,
    with_precise_errors,
    with_whitened_cost,
)
from ..estimate.fitted_model import FittedModel
from ..estimate.minimum import RELEVANT
from ..estimate.problem import (
    FitData,
    Problem,
    with_shared_motions,
    within_noise,
    within_tolerance,
)
from ..estimate.starts import ROUGH_ITERATIONS, TRIAL_ITERATIONS, share_of_first_swings, vibrates
from ..least_squares import predicted_reduction
from ..noise.whitening import Whitener
from ..processors import thread_pool

REFITTED = 5
"""Candidates that are refitted: the best by score and by expected reduction."""


OnProgress = Callable[[str], bool]
"""Called with what was just done; True stops."""

OnStage = Callable[[str, int | None], None]
"""Called with title and number of steps, if that is known, where a new stage begins."""


def search_round(
    data: FitData, before: FitResult, present: Sequence[Effect], candidates: Sequence[Effect],
    on_progress: OnProgress, on_screen: Callable[[Screen], None] | None = None,
    on_refit: Callable[[Round], None] = lambda _: None, most: int = 1,
    judge: Judge | None = None, on_stage: OnStage = lambda _title, _total: None,
) -> Round:  # fmt: skip
    """Rank the candidates and converge the model with the best, if it is acceptable.

    `on_screen` gets the screen while it goes on and at its end. `most`: how many effects may be
    added; 0 only ranks, and `after` is `before`. What the `judge` refuses is not added. `on_stage`
    gets the title and the steps of what follows the screen.
    """
    judge = judge or Judge(FittedModel(data, before, tuple(present)))
    data = with_shared_motions(data, before.problem)
    screened = screen(data, before.problem, present, candidates, on_progress, on_screen)
    if on_screen is not None:
        on_screen(screened)
    before = with_whitened_cost(before, screened.whitener)
    stopped: Callable[[], bool] = lambda: on_progress("")  # noqa: E731
    found = Round(screened, (), None, before, before, data)
    # Within the noise nothing can be missing, whatever is explained below the floor.
    if stopped() or within_noise(data, before.errors):
        return found
    chosen = _chosen(screened, data, before, present, stopped)
    acceptance = Acceptance(data, before, present, screened, len(candidates), stopped, judge)
    failed: list[str] = []
    groups = _slow_starts_last(chosen, data, before, present)
    for title, group in zip((REFITS, SLOW_REFITS), groups, strict=False):
        on_stage(title, len(group))
        refitted = list(found.refitted)
        for candidate in _refit_candidates(found, present, group, len(candidates), on_progress):
            refitted.append(candidate)
            on_progress(f"{candidate.screened.effect.title} refitted")
            on_refit(replace(found, refitted=tuple(ranked_candidates(refitted))))
        fitted = {w.screened.effect.kind for w in refitted}
        failed += [s.effect.title for s in group if s.effect.kind not in fitted]
        ranked = unseen_decide(ranked_candidates(refitted), judge.fit_to_unseen)
        found = replace(found, refitted=tuple(ranked), failed_refits=tuple(failed))
        if stopped():
            break
        last = group is groups[-1]
        if last or (ranked and within_noise(data, ranked[0].refit.errors)):
            on_stage(ACCEPTANCE, None)
            accepted = acceptance.accept(ranked, most)
            if accepted.added or last:
                return replace(accepted, failed_refits=found.failed_refits)
    return found


def _chosen(
    screened: Screen, data: FitData, before: FitResult, present: Sequence[Effect],
    stopped: Callable[[], bool],
) -> list[ScreenedCandidate]:  # fmt: skip
    """The candidates that are refitted, with those that they become at an end of their range."""
    chosen = most_promising(screened, data.count)
    if within_tolerance(data, before.errors):
        least = WHOLE_SHARE * (before.cost - data.count)
        return [s for s in chosen if s.largest_reduction >= least]
    most = max((s.largest_reduction for s in screened.candidates), default=0.0)
    predicted = share_above_noise(most, before.cost, data.count)
    if chosen and predicted < WHOLE_SHARE:
        chosen = chosen + vibrating(screened, chosen, data, before, present, predicted, stopped)
    special = {kind for s in chosen for kind in s.effect.special_cases}
    others = [s for s in screened.candidates if s.effect.kind in special and s not in chosen]
    return chosen + others


def _slow_starts_last(
    chosen: Sequence[ScreenedCandidate], data: FitData, before: FitResult, present: Sequence[Effect]
) -> list[list[ScreenedCandidate]]:
    """Effects whose starts must be searched come after the others, which may leave no more than
    noise. One group at least, perhaps of none: a set of effects may explain what none does."""
    base = before.problem
    slow = [s for s in chosen if s.scanned and vibrates(data, base, [*present, s.effect], s.values)]
    first = [s for s in chosen if s not in slow]
    return [first, slow] if slow and first else [first or slow]


def _refit_candidates(
    found: Round, present: Sequence[Effect], chosen: Sequence[ScreenedCandidate],
    candidate_count: int, on_progress: OnProgress,
) -> Iterator[RefittedCandidate]:  # fmt: skip
    """The chosen candidates as their refits end, on all cores; without those that could not be
    simulated."""
    data, before, screened = found.data, found.before, found.screen
    stopped = lambda: on_progress("")  # noqa: E731

    def begin(s: ScreenedCandidate) -> PartialRefit:
        effects, base = [*present, s.effect], before.problem
        rest = screened.slopes, s.scanned, stopped
        partial = begin_refit(data, base, effects, s.values, *rest)
        if not np.isfinite(partial.refit.cost):
            values = nearer_to_neutral(s.effect, base.model.arm, data, s.values)
            partial = begin_refit(data, base, effects, values, *rest)
        return partial

    with thread_pool(len(chosen)) as pool:
        runners = list(pool.map(begin, chosen))
        continuing = still_competitive(runners, data.count)
        waiting = {
            pool.submit(finish_refit, data, runner, on, screened.whitener, stopped): s
            for s, runner, on in zip(chosen, runners, continuing, strict=True)
        }
        for done in as_completed(waiting):
            refit = done.result()
            if np.isfinite(refit.cost):
                yield assess_refit(waiting[done], before, refit, data.count, candidate_count)


def vibrating(
    screened: Screen, chosen: Sequence[ScreenedCandidate], data: FitData, before: FitResult,
    present: Sequence[Effect], predicted: float, stopped: Callable[[], bool],
) -> list[ScreenedCandidate]:  # fmt: skip
    """Candidates that explain more of the first swings than the share that is `predicted` of the
    whole recordings.

    There the sizes of a grid are out of step with a vibration that is hardly damped, so that the
    screen overlooks it.
    """
    left = [s for s in screened.candidates if s not in chosen]

    def share(s: ScreenedCandidate) -> float:
        effects, base = [*present, s.effect], before.problem
        return share_of_first_swings(data, base, effects, s.values, s.scanned, stopped)

    with thread_pool(len(left)) as pool:
        shares = pool.map(share, left)
        return [s for s, explained in zip(left, shares, strict=True) if explained > predicted]


def most_promising(screened: Screen, count: int) -> list[ScreenedCandidate]:
    """Half of the best by whitened score, the rest by largest reduction."""
    within = [s for s in screened.candidates if s.largest_reduction >= RELEVANT * count]
    by_score = sorted(within, key=lambda s: -s.score)
    by_reduction = sorted(within, key=lambda s: -s.largest_reduction)
    chosen: dict[str, ScreenedCandidate] = {}
    for pair in zip(by_score, by_reduction, strict=True):
        for s in pair:
            if len(chosen) < REFITTED:
                chosen.setdefault(s.effect.kind, s)
    return list(chosen.values())


OPTIMISM = 2.0
"""Factor on the predicted reduction of the next step, as a descent whose steps halve the remainder
ends there; and on the error above noise of the best, within which a refit goes on."""


@dataclass(frozen=True)
class PartialRefit:
    """A refit after its first iterations."""

    refit: FitResult
    left: int
    """Iterations that it may still take."""
    reused: SlopesByLabel

    @property
    def bound(self) -> float:
        """The lowest cost that it may still reach."""
        descended, problem = self.refit.descended, self.refit.problem
        if not np.isfinite(descended.cost):
            return np.inf
        return descended.cost - OPTIMISM * predicted_reduction(descended, problem.limits)


def begin_refit(
    data: FitData, base: Problem, effects: Sequence[Effect],
    values: Mapping[str, float], slopes: Sequence[np.ndarray], scanned: Sequence[str],
    stopped: Callable[[], bool],
) -> PartialRefit:  # fmt: skip
    """The first iterations of `core.estimate.fit_result.refit_with`."""
    start, spent, reused = best_start(data, base, effects, values, slopes, scanned, stopped)
    remaining = ROUGH_ITERATIONS - spent
    return PartialRefit(
        fit(start, None, stopped, TRIAL_ITERATIONS, reused), remaining - TRIAL_ITERATIONS, reused
    )


def finish_refit(
    data: FitData,
    runner: PartialRefit,
    goes_on: bool,
    whitener: Whitener,
    stopped: Callable[[], bool],
) -> FitResult:
    """The refit, with its remaining iterations if it `goes_on` and has not ended; the winner equals
    a full refit."""
    refit = runner.refit
    if goes_on and not refit.descended.ended:
        at, damping = refit.problem, refit.descended.damping
        refit = fit(at, None, stopped, runner.left, runner.reused, damping)
    return with_precise_errors(data, refit, whitener)


def still_competitive(runners: Sequence[PartialRefit], count: int) -> list[bool]:
    """Whether each refit may still leave about as little above the noise as the best one now."""
    best = min((r.refit.cost for r in runners), default=0.0)
    most = count + OPTIMISM * max(best - count, RELEVANT * count)
    return [r.bound <= most for r in runners]
