"""The ladder as it is stated: one set of noise floors, and effects in the order of what they
explain.

While several effects are missing, the first one found may be an imitation that is later removed or
exchanged. A better model may also show other noise floors, or a better minimum. Then the base model
is fitted and ranked again in the last floors, and the ladder is rebuilt with the final set: each
step adds the effect that explains most of the remaining error.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ..diagnose.acceptance import Round
from ..diagnose.base_fit import BaseFit
from ..diagnose.cost_minimum import converge
from ..diagnose.effect_search import add_round
from ..diagnose.evidence import assess_refit
from ..diagnose.fit_problem import Data, hypothesis
from ..diagnose.linear_screen import Screen, ScreenedCandidate
from ..diagnose.ranking import ranking_of
from ..diagnose.refit import Refit, fit, with_whitened_cost
from ..diagnose.refit_starts import ROUGH_ITERATIONS
from ..diagnose.search_state import Options, State, base_ladder_step, ladder_step_of
from ..diagnose.whitening import fit_whitener, whitened_rows
from ..effects.effect import Effect
from ..progress import Progress
from ..results import DiagnosisRound


def final_ladder(
    state: State, base_fit: BaseFit, options: Options, progress: Progress
) -> tuple[State, BaseFit]:
    """The search with all steps compared alike, and its base model. If stopped on the way, the
    search in the first floors."""
    first_fit, before = base_fit, state.copied()
    better = bool(state.removed) and not state.added and state.refit.cost < base_fit.base.cost
    if (state.out_of_date or better) and not progress.stopped():
        base_fit = _refit_base(state, base_fit, options, progress)
    detour = state.removed or state.out_of_date or len(state.ladder) != 1 + len(state.added)
    if detour and state.added:
        rebuilt = _rebuild_ladder(state, base_fit.base, progress)
        if not rebuilt and not progress.stopped():
            return before, first_fit
    if progress.stopped() and before.out_of_date:
        return before.before_floor_update or before, first_fit
    return state, base_fit


def _refit_base(state: State, base_fit: BaseFit, options: Options, progress: Progress) -> BaseFit:
    """The base model in the last floors with its ranking, which replaces all rounds but the last
    one without an accepted effect. Without added effects the current model is the base model."""
    data, base = state.data, state.refit
    if state.added:
        before = base_fit.base.hypothesis
        start = hypothesis(replace(data, anchor=None), before.model.effects, before.values())
        data, base = converge(replace(data, anchor=None), start, None, progress.stopped)
    new_fit = replace(base_fit, data=data, base=base, validation=state.validation, cached_fit=None)
    last = [r for r in state.rounds[-1:] if r.accepted is None and state.added]
    stated = state.present[: state.stated_count]
    again = State(
        data, base, stated, len(stated), [], [base_ladder_step(new_fit)], state.validation,
        validation_cache=state.validation_cache,
    )  # fmt: skip
    add_round(again, options, 0, progress, extra=state.added)
    state.first_screen, state.ladder = again.first_screen, again.ladder
    state.rounds = [*again.rounds, *last]
    if not state.added:
        state.removed.clear()
        state.data = again.data
    return new_fit


def _rebuild_ladder(state: State, base: Refit, progress: Progress) -> bool:
    """Rebuilds the ladder from the effects in the final model. Whether it was possible."""
    if state.first_screen is None:
        return False
    steps = ladder_to_final_model(
        state.data, base, state.refit, state.present[: state.stated_count], state.added,
        state.first_screen, state.rounds, progress.stopped,
    )  # fmt: skip
    if not steps:
        return False
    unaccepted = [r for r in state.rounds[-1:] if r.accepted is None and len(state.rounds) > 1]
    state.rounds = [*(c.round for c in steps), *unaccepted]
    del state.ladder[1:]
    for step in steps:
        state.data, state.refit = step.data, step.refit
        state.ladder.append(ladder_step_of(state, step.effect, step.effect.title))
    return True


@dataclass(frozen=True)
class RebuiltLadderStep:
    """One step of the rebuilt ladder."""

    effect: Effect
    data: Data
    """Anchored at `refit`."""
    refit: Refit
    round: DiagnosisRound
    """Ranking against the step before; for the first step with all that was tried."""


def ladder_to_final_model(
    data: Data, base: Refit, last: Refit, stated: Sequence[Effect], added: Sequence[Effect],
    screened: Screen, rounds: Sequence[DiagnosisRound], stopped: Callable[[], bool],
) -> list[RebuiltLadderStep]:  # fmt: skip
    """The steps from the base model to the last one, in the order of what each effect explains;
    none where an effect was never screened against the model as given, or when stopped. `data` are
    anchored at `last`; `screened` is the screen of the first round, whose ranking in `rounds` is
    kept beside the first step's effect."""
    by_kind = {s.effect.kind: s for s in screened.candidates}
    if not {e.kind for e in added} <= set(by_kind):
        return []
    steps: list[RebuiltLadderStep] = []
    before, remaining = base, list(added)
    # The first step stands beside what was tried then; later ones are held against the noise as
    # the last model shows it: beside all that the first one lacks they would seem to be nothing.
    noise = fit_whitener(last.errors, whitened_rows(data.experiments))
    while remaining:
        present = [*stated, *[c.effect for c in steps]]
        strongest, anchored, after = _strongest_effect(data, last, present, remaining, stopped)
        if stopped():
            return []
        remaining.remove(strongest)
        other_ranks = rounds[0].ranking if rounds and not steps else ()
        whitener = noise if steps else screened.whitener
        both = with_whitened_cost(before, whitener), with_whitened_cost(after, whitener)
        repeated = _ladder_round(by_kind[strongest.kind], screened, *both, anchored, other_ranks)
        steps.append(RebuiltLadderStep(strongest, anchored, after, repeated))
        before = after
    return steps


def _strongest_effect(
    data: Data, last: Refit, present: Sequence[Effect], remaining: Sequence[Effect],
    stopped: Callable[[], bool],
) -> tuple[Effect, Data, Refit]:  # fmt: skip
    """The effect that leaves the least error, and the data and refit with it."""
    if len(remaining) == 1:
        return remaining[0], data, last
    values = last.hypothesis.values()
    refits = [
        (fit(hypothesis(data, [*present, e], values), None, stopped, ROUGH_ITERATIONS), e)
        for e in remaining
    ]
    rough, best = min(refits, key=lambda pair: pair[0].cost)
    at, after = converge(data, rough.hypothesis, None, stopped)
    return best, at, after


def _ladder_round(
    screened: ScreenedCandidate, round_screen: Screen, before: Refit, after: Refit, data: Data,
    other_ranks: Sequence[Any],
) -> DiagnosisRound:  # fmt: skip
    """The effect ranked against the step before, with the other ranks there."""
    assessed = assess_refit(screened, before, after, data.count, len(round_screen.candidates))
    first = ranking_of(Round(round_screen, (assessed,), assessed, before, after, data), data)[:1]
    kind = screened.effect.kind
    return DiagnosisRound((*first, *(r for r in other_ranks if r.effect != kind)), kind)
