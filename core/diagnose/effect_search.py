"""The search: rounds add effects, needless effects are removed, better ones exchanged."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from ..diagnose.acceptance import ModelCheck, Round
from ..diagnose.bending_shapes_within_noise import bending_shape_round
from ..diagnose.cost_minimum import (
    converge,
    converge_precisely,
    law_error,
    with_simulated_deviations,
)
from ..diagnose.evidence import RELEVANT
from ..diagnose.fit_problem import Data, with_shared_motions
from ..diagnose.linear_screen import Screen, screen
from ..diagnose.next_experiment import deciding_experiments
from ..diagnose.output_changes import trials
from ..diagnose.progress_messages import RoundProgress, round_title
from ..diagnose.ranking import ranking_of
from ..diagnose.refit import Refit
from ..diagnose.remaining_error import remaining_error, within_noise
from ..diagnose.removal_and_exchange import best_exchange, needed_effects
from ..diagnose.search_round import REFITTED, applicable, search_round
from ..diagnose.search_state import Options, RankingCallback, RemainingTrials, State, ladder_step_of
from ..effects.effect import Effect
from ..least_squares import cost_of
from ..progress import Progress
from ..results import DiagnosisRound, Objection, Reason
from ..sentences import listed

MOST_RETURNS = 2
"""Repeated additions, after added effects turned out needless."""


def search_effects(
    state: State, options: Options, progress: Progress, on_ranking: RankingCallback | None
) -> bool:
    """Adds effects, removes needless ones and exchanges effects for better ones; repeats if one was
    removed and an error is left. Whether another effect is known to be missing."""
    for returns in range(MOST_RETURNS + 1):
        more, before = _add_effects(state, options, progress, on_ranking), len(state.removed)
        remove_needless(state, progress)
        _exchange_effects(state, options, progress)
        if len(state.removed) == before or progress.stopped() or returns == MOST_RETURNS:
            break
        if not remaining_error(state.data, state.refit.errors).above:
            more = False
            break
    _add_bending_shapes(state, options, progress)
    return more


def _add_effects(
    state: State, options: Options, progress: Progress, on_ranking: RankingCallback | None
) -> bool:
    """Adds effects while a round finds some. Whether another effect is known to be missing.

    At the limit one more round tests whether an effect explains the remaining error. A model that
    leaves only noise gets a round only if there was none yet, for its ranking.
    """
    if state.rounds and within_noise(state.data, state.refit.errors):
        return False
    while True:
        most = options.max_effects - len(state.added)
        new_round = add_round(state, options, most, progress, on_ranking)
        if not new_round.added:
            return new_round.accepted is not None
        _add(state, new_round)
        above = remaining_error(state.data, state.refit.errors).above
        full = len(state.added) >= options.max_effects
        within = within_noise(state.data, state.refit.errors)
        if progress.stopped() or within or (full and not above):
            return False


def _add_bending_shapes(state: State, options: Options, progress: Progress) -> None:
    """Adds bending shapes to a model that leaves only noise, if the recordings are then far more
    likely; removes effects that become needless."""
    while len(state.added) < options.max_effects and not progress.stopped():
        candidates = applicable(state.data, state.present, options.candidates)
        extra_shape = next((e for e in candidates if e.resolution), None)
        if extra_shape is None or not within_noise(state.data, state.refit.errors):
            return
        progress.stage("Trying more bending shapes")
        new_round = bending_shape_round(
            state.data,
            state.refit,
            state.present,
            extra_shape,
            _model_check(state),
            progress.stopped,
        )
        if new_round is None:
            return
        if state.rounds and state.rounds[-1].accepted is None:
            state.rounds.pop()
        state.rounds.append(DiagnosisRound(ranking_of(new_round, state.data), extra_shape.kind))
        _use_data(state, new_round.data)
        _add(state, new_round)
        remove_needless(state, progress)


def _add(state: State, new_round: Round) -> None:
    """Adds the effects of a round; after several at once the ladder is rebuilt at the end."""
    effects = [candidate.screened.effect for candidate in new_round.added]
    state.present += effects
    state.refit = new_round.after
    state.ladder.append(ladder_step_of(state, effects[-1], listed([e.title for e in effects])))
    update_law_error(state)


def update_law_error(state: State) -> None:
    """Updates what the idealised laws of the model's effects may miss."""
    state.data = replace(state.data, law_errors=law_error(state.data, state.refit))


def add_round(
    state: State, options: Options, most: int, progress: Progress,
    on_ranking: RankingCallback | None = None, extra: Sequence[Effect] = (),
) -> Round:  # fmt: skip
    """Runs one round and stores its ranking; the caller adds its effects. `extra` effects are
    ranked too."""
    update_law_error(state)
    candidates, refit = applicable(state.data, state.present, options.candidates), state.refit
    candidates += [e for e in extra if e.kind not in {c.kind for c in candidates}]
    planned = [t for c in candidates for t in trials(refit.hypothesis, c, state.data)]
    steps = RoundProgress(progress, refit.hypothesis.model.arm, planned)
    total = len(candidates) + REFITTED + any(e.resolution for e in candidates)  # see promising
    steps.begin(round_title(state.present, bool(options.candidates)), total)
    new_round = _run_round(state, candidates, most, steps, on_ranking)
    ranking = ranking_of(new_round, state.data)
    experiments = deciding_experiments(new_round, ranking, state.data, progress)
    not_simulated = tuple(dict.fromkeys((*new_round.screen.diverged, *new_round.failed_refits)))
    kinds: list[str | None] = [a.screened.effect.kind for a in new_round.added]
    kinds = kinds or [None]
    for k, kind in enumerate(kinds):
        remaining = tuple(r for r in ranking if r.effect not in kinds[:k])
        state.rounds.append(
            DiagnosisRound(remaining, kind, tuple(new_round.refused), not_simulated, experiments)
        )
    state.first_screen = state.first_screen or new_round.screen
    state.last_screen = refit, new_round.screen
    _use_data(state, new_round.data)
    return new_round


def _use_data(state: State, data: Data) -> None:
    """Uses the data of a round, and its number of steps for validation recordings."""
    state.data = data
    if state.validation is not None:
        state.validation = replace(state.validation, result_substeps=data.result_substeps)


def remove_needless(state: State, progress: Progress) -> None:
    """Removes effects until none is needless: without one effect, another may become needless."""
    while not progress.stopped():
        kept = needed_effects(
            state.data, state.refit, state.present, state.stated_count, progress.stopped
        )
        removed = [e for e in state.present if e not in kept.effects]
        if not removed:
            return
        state.data, state.refit = converge(
            state.data, kept.refit.hypothesis, None, progress.stopped
        )
        state.present = list(kept.effects)
        update_law_error(state)
        state.removed += [e.title for e in removed]
        names = ", ".join(e.title for e in removed)
        state.ladder.append(ladder_step_of(state, None, f"Without: {names}"))


MOST_EXCHANGES = 3
"""Each exchange leads closer to the best set; more were never seen."""


def _exchange_effects(state: State, options: Options, progress: Progress) -> None:
    """Exchanges added effects for better ones, if there are several: the first was chosen while the
    others were missing."""
    for _ in range(MOST_EXCHANGES):
        if len(state.added) < 2 or progress.stopped():
            return
        screened = _current_screen(state, options, progress)
        exchange = best_exchange(
            state.data, state.refit, state.present, state.stated_count, screened, progress.stopped
        )
        if exchange is None:
            return
        refit, effects = exchange
        data, refit = converge(state.data, refit.hypothesis, screened.whitener, progress.stopped)
        # The whitener knows the error of the model as it stands; one that leaves relevantly more
        # of it is no better explanation, whatever its colour says.
        worse = refit.cost - state.refit.cost > RELEVANT * data.count
        if worse or _model_check(state)(data, refit):
            return
        _replace_effects(state, data, refit, effects)
        remove_needless(state, progress)


def _current_screen(state: State, options: Options, progress: Progress) -> Screen:
    """Screen of the current model; that of the last round if the model has not changed."""
    if state.last_screen is not None and state.last_screen[0] is state.refit:
        return state.last_screen[1]
    at = state.refit.hypothesis
    state.data = with_shared_motions(state.data, at)
    candidates = applicable(state.data, state.present, options.candidates)
    return screen(state.data, at, state.present, candidates, lambda _: progress.stopped())


def _replace_effects(state: State, data: Data, refit: Refit, effects: Sequence[Effect]) -> None:
    """Replaces effects by another one; the ladder is rebuilt at the end."""
    removed = [e for e in state.present if e not in effects]
    parts = {kind for e in removed for kind in e.includes}
    added = next(e for e in effects if e not in state.present and e.kind not in parts)
    titles = [e.title for e in removed]
    state.data, state.refit, state.present = data, refit, list(effects)
    update_law_error(state)
    state.ladder.append(ladder_step_of(state, added, f"{added.title} for {', '.join(titles)}"))
    state.removed += titles


def converge_final_model(state: State, options: Options, progress: Progress) -> None:
    """Converges the last model precisely; earlier ones need fewer digits."""
    if progress.stopped():
        return
    state.data, state.refit = converge_precisely(state.data, state.refit, progress.stopped)
    update_law_error(state)
    if state.data.rig.servo:
        state.refit = with_simulated_deviations(state.data, state.refit, options.stated_noise)
    last = state.ladder[-1]
    added = next((e for e in state.present if e.kind == last.added), None)
    state.ladder[-1] = ladder_step_of(state, added, last.title)


WORSE = 1.1
"""Ratio of validation errors above which an effect is rejected: above what refitted starts and
noise change it (1.02 in recordings of an independent engine)."""


def _model_check(state: State) -> ModelCheck:
    """Rejects a model that increases the validation error by more than noise could."""
    before = state.refit

    def refuse(data: Data, refit: Refit) -> Objection | None:
        before_fit = state.validation_fit(before)
        after_fit = state.validation_fit(refit, data.result_substeps)
        if before_fit is None or after_fit is None:
            return None
        error_before, error_after = (
            cost_of(v.errors) / v.data.count for v in (before_fit, after_fit)
        )
        if error_after - error_before < RELEVANT or error_after < WORSE**2 * error_before:
            return None
        return Objection(Reason.UNSEEN, unseen=(math.sqrt(error_before), math.sqrt(error_after)))

    return refuse


def _run_round(
    state: State, candidates: Sequence[Effect], most: int, steps: RoundProgress,
    on_ranking: RankingCallback | None,
) -> Round:  # fmt: skip
    def screened(screened_so_far: Screen) -> None:
        refitted(Round(screened_so_far, (), None, state.refit, state.refit, state.data))

    def refitted(partial: Round) -> None:
        assert on_ranking is not None
        tested = {c.effect.kind for c in partial.screen.output_changes}
        remaining = partial.screen.remaining_trials
        untested = tuple(c.title for c in candidates if remaining and c.kind not in tested)
        on_ranking(ranking_of(partial, state.data), RemainingTrials(remaining, untested))

    callbacks = {} if on_ranking is None else {"on_screen": screened, "on_refit": refitted}
    return search_round(
        state.data, state.refit, state.present, candidates, steps, most=most,
        check=_model_check(state), **callbacks,  # type: ignore[arg-type]
    )  # fmt: skip
