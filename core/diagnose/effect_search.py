"""The search: rounds that add effects, what they make needless, and what stands in for something
better."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from ..diagnose.acceptance import Gate, Round
from ..diagnose.cost_minimum import converged, missed_by_laws, precise, widened
from ..diagnose.evidence import RELEVANT
from ..diagnose.fit_problem import Data, sharing_motions
from ..diagnose.linear_screen import Screen, screen
from ..diagnose.more_bending_shapes import finer_round
from ..diagnose.next_experiment import deciding
from ..diagnose.output_changes import trials
from ..diagnose.progress_messages import Steps, round_title
from ..diagnose.ranking import ranking_of
from ..diagnose.refit import Refit
from ..diagnose.remaining_error import remains, within_noise
from ..diagnose.removal_and_exchange import best_exchange, without_needless
from ..diagnose.search_round import REFITTED, applicable, one_round
from ..diagnose.search_state import Options, RankingCallback, State, ToCome, step_of
from ..effects.effect import Effect
from ..least_squares import cost_of
from ..progress import Progress
from ..results import DiagnosisRound, Objection, Reason
from ..sentences import listed

MOST_RETURNS = 2
"""To the climb, after effects that it added turned out needless."""


def search(
    state: State, options: Options, progress: Progress, on_ranking: RankingCallback | None
) -> bool:
    """Climbs, takes out what is needless and exchanges what stands in for something better; begins
    anew where that made room and an error is left. Whether another effect is known to be missing.
    """
    for returns in range(MOST_RETURNS + 1):
        more, before = _climb(state, options, progress, on_ranking), len(state.passed)
        prune(state, progress)
        _exchange(state, options, progress)
        if len(state.passed) == before or progress.stopped() or returns == MOST_RETURNS:
            break
        if not remains(state.data, state.refit.errors).above:
            more = False
            break
    _refine(state, options, progress)
    return more


def _climb(
    state: State, options: Options, progress: Progress, on_ranking: RankingCallback | None
) -> bool:
    """Adds effects while there are some to add; whether another one is known to be missing.

    At the limit one more look tells whether what is left above the floor is on the list.
    """
    while True:
        most = options.max_effects - len(state.found)
        seen = look(state, options, most, progress, on_ranking)
        if not seen.added:
            return seen.accepted is not None
        _add(state, seen)
        above = remains(state.data, state.refit.errors).above
        full = len(state.found) >= options.max_effects
        within = within_noise(state.data, state.refit.errors)
        if progress.stopped() or within or (full and not above):
            return False


def _refine(state: State, options: Options, progress: Progress) -> None:
    """Adds bending shapes to a model that leaves no more than noise, where the recordings are far
    more likely with them; what they make needless is taken out."""
    while len(state.found) < options.max_effects and not progress.stopped():
        known = applicable(state.data, state.present, options.candidates)
        finer = next((e for e in known if e.resolution), None)
        if finer is None or not within_noise(state.data, state.refit.errors):
            return
        progress.stage("Trying more bending shapes")
        found = finer_round(
            state.data, state.refit, state.present, finer, _gate(state), progress.stopped
        )
        if found is None:
            return
        if state.rounds and state.rounds[-1].accepted is None:
            state.rounds.pop()
        state.rounds.append(DiagnosisRound(ranking_of(found, state.data), finer.kind))
        _go_on_with(state, found.data)
        _add(state, found)
        prune(state, progress)


def _add(state: State, seen: Round) -> None:
    """What a round adds; of several at once the ladder is climbed again at the end."""
    effects = [one.screened.effect for one in seen.added]
    state.present += effects
    state.refit = seen.after
    state.steps.append(step_of(state, effects[-1], listed([e.title for e in effects])))
    trust_laws(state)


def trust_laws(state: State) -> None:
    """From now on what is left counts beside what the laws in the model may miss."""
    state.data = replace(state.data, idealised=missed_by_laws(state.data, state.refit))


def look(
    state: State,
    options: Options,
    most: int,
    progress: Progress,
    on_ranking: RankingCallback | None = None,
    also: Sequence[Effect] = (),
) -> Round:
    """One round, kept with its ranking; what it adds is left to the caller. `also` is ranked beside
    what is offered."""
    trust_laws(state)
    candidates, at = applicable(state.data, state.present, options.candidates), state.refit
    candidates += [e for e in also if e.kind not in {c.kind for c in candidates}]
    planned = [t for c in candidates for t in trials(at.hypothesis, c, state.data)]
    steps = Steps(progress, at.hypothesis.model.arm, planned)
    total = len(candidates) + REFITTED + any(e.resolution for e in candidates)  # see promising
    steps.begin(round_title(state.present, bool(options.candidates)), total)
    seen = _round(state, candidates, most, steps, on_ranking)
    ranking = ranking_of(seen, state.data)
    next_ones = deciding(seen, ranking, state.data, progress)
    lost = tuple(dict.fromkeys((*seen.screen.diverged, *seen.unfitted)))
    kinds: list[str | None] = [a.screened.effect.kind for a in seen.added]
    kinds = kinds or [None]
    for k, kind in enumerate(kinds):
        left = tuple(r for r in ranking if r.effect not in kinds[:k])
        state.rounds.append(DiagnosisRound(left, kind, tuple(seen.refused), lost, next_ones))
    state.first, state.screened = state.first or seen.screen, (at, seen.screen)
    _go_on_with(state, seen.data)
    return seen


def _go_on_with(state: State, data: Data) -> None:
    """The comparison of a round from now on, and its steps for unseen recordings too."""
    state.data = data
    if state.validation is not None:
        state.validation = replace(state.validation, fine=data.fine)


def prune(state: State, progress: Progress) -> None:
    """Until nothing is needless: without one effect the others come to rest elsewhere, and the
    next one may have lost its use."""
    while not progress.stopped():
        kept = without_needless(
            state.data, state.refit, state.present, state.given, progress.stopped
        )
        removed = [e for e in state.present if e not in kept.effects]
        if not removed:
            return
        state.data, state.refit = converged(
            state.data, kept.refit.hypothesis, None, progress.stopped
        )
        state.present = list(kept.effects)
        trust_laws(state)
        state.passed += [e.title for e in removed]
        names = ", ".join(e.title for e in removed)
        state.steps.append(step_of(state, None, f"Without: {names}"))


MOST_EXCHANGES = 3
"""Each shortens the way to the best set by one; more were never seen."""


def _exchange(state: State, options: Options, progress: Progress) -> None:
    """Puts better effects in the place of accepted ones, where several were accepted: the first of
    them was chosen while the others were missing."""
    for _ in range(MOST_EXCHANGES):
        if len(state.found) < 2 or progress.stopped():
            return
        seen = _screen_of(state, options, progress)
        found = best_exchange(
            state.data, state.refit, state.present, state.given, seen, progress.stopped
        )
        if found is None:
            return
        refit, effects = found
        data, refit = converged(state.data, refit.hypothesis, seen.whitener, progress.stopped)
        # The whitener knows the error of the model as it stands; one that leaves relevantly more
        # of it is no better explanation, whatever its colour says.
        worse = refit.cost - state.refit.cost > RELEVANT * data.count
        if worse or _gate(state)(data, refit):
            return
        _replace(state, data, refit, effects)
        prune(state, progress)


def _screen_of(state: State, options: Options, progress: Progress) -> Screen:
    """Of the model as it stands; that of the last round where it looked at this model."""
    if state.screened is not None and state.screened[0] is state.refit:
        return state.screened[1]
    at = state.refit.hypothesis
    state.data = sharing_motions(state.data, at)
    candidates = applicable(state.data, state.present, options.candidates)
    return screen(state.data, at, state.present, candidates, lambda _: progress.stopped())


def _replace(state: State, data: Data, refit: Refit, effects: Sequence[Effect]) -> None:
    """Puts one effect in the place of others; the ladder is climbed again at the end."""
    gone = [e for e in state.present if e not in effects]
    parts = {kind for e in gone for kind in e.includes}
    came = next(e for e in effects if e not in state.present and e.kind not in parts)
    titles = [e.title for e in gone]
    state.data, state.refit, state.present = data, refit, list(effects)
    trust_laws(state)
    state.steps.append(step_of(state, came, f"{came.title} for {', '.join(titles)}"))
    state.passed += titles


def settle(state: State, options: Options, progress: Progress) -> None:
    """States the last model at its minimum; what led there needs no such digits."""
    if progress.stopped():
        return
    state.data, state.refit = precise(state.data, state.refit, progress.stopped)
    trust_laws(state)
    if state.data.rig.servo:
        state.refit = widened(state.data, state.refit, options.stated_noise)
    last = state.steps[-1]
    added = next((e for e in state.present if e.kind == last.added), None)
    state.steps[-1] = step_of(state, added, last.title)


WORSE = 1.1
"""Times the error on unseen recordings beyond which an effect made it worse: above what starts
that are fitted anew and noise move it (1.02 in recordings of an independent engine)."""


def _gate(state: State) -> Gate:
    """Refuses what makes recordings that no fit saw worse by more than noise could."""
    before = state.refit

    def refuse(data: Data, refit: Refit) -> Objection | None:
        was_seen, after = state.validated(before), state.validated(refit, data.fine)
        if was_seen is None or after is None:
            return None
        was, now = (cost_of(v.errors) / v.data.count for v in (was_seen, after))
        if now - was < RELEVANT or now < WORSE**2 * was:
            return None
        return Objection(Reason.UNSEEN, unseen=(math.sqrt(was), math.sqrt(now)))

    return refuse


def _round(
    state: State,
    candidates: Sequence[Effect],
    most: int,
    steps: Steps,
    on_ranking: RankingCallback | None,
) -> Round:
    def screened(seen: Screen) -> None:
        refitted(Round(seen, (), None, state.refit, state.refit, state.data))

    def refitted(partial: Round) -> None:
        assert on_ranking is not None
        known, sizes = {c.effect.kind for c in partial.screen.columns}, partial.screen.to_come
        untried = tuple(c.title for c in candidates if sizes and c.kind not in known)
        on_ranking(ranking_of(partial, state.data), ToCome(sizes, untried))

    heard = {} if on_ranking is None else {"on_screen": screened, "on_refit": refitted}
    return one_round(
        state.data, state.refit, state.present, candidates, steps, most=most, gate=_gate(state),
        **heard,  # type: ignore[arg-type]
    )  # fmt: skip
