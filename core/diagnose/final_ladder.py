"""The ladder as it is stated: one floor, one minimum, and the effects in the order of what each
explains.

While several effects are missing, what comes first may be an imitation that a later one makes
needless, or that is exchanged; and a better model may show other noise floors, or a better minimum.
The set at the end is what counts. So where the search took such a detour, the model as given is
fitted and ranked again in the last floors, and the ladder is climbed with that set: at each step
the effect that explains most of what is left.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ..diagnose.acceptance import Round
from ..diagnose.base_fit import Begun
from ..diagnose.cost_minimum import converged
from ..diagnose.effect_search import look
from ..diagnose.evidence import weigh
from ..diagnose.fit_problem import Data, hypothesis
from ..diagnose.linear_screen import Screen, Screened
from ..diagnose.ranking import ranking_of
from ..diagnose.refit import Refit, fit, whitened
from ..diagnose.refit_starts import ROUGH_ITERATIONS
from ..diagnose.search_state import Options, State, given_step, step_of
from ..diagnose.whitening import Whitener, fit_whitener, whitened_rows
from ..effects.effect import Effect
from ..progress import Progress
from ..results import DiagnosisRound


def final_ladder(
    state: State, begun: Begun, options: Options, progress: Progress
) -> tuple[State, Begun]:
    """The search with all of it weighed alike, and the model as given that it is compared with.

    What is stopped on the way goes back to where all was weighed in the first floors.
    """
    first, before = begun, state.copied()
    better = bool(state.passed) and not state.found and state.refit.cost < begun.base.cost
    if (state.out_of_date or better) and not progress.stopped():
        begun = _given_again(state, begun, options, progress)
    detour = state.passed or state.out_of_date or len(state.steps) != 1 + len(state.found)
    if detour and state.found:
        climbed = _climb_again(state, begun.base, progress)
        if not climbed and not progress.stopped():
            return before, first
    if progress.stopped() and before.out_of_date:
        return before.earlier or before, first
    return state, begun


def _given_again(state: State, begun: Begun, options: Options, progress: Progress) -> Begun:
    """The model as given in the last floors with its ranking, which replaces all rounds but the
    last word; where nothing was added it stands where the search has led it."""
    data, base = state.data, state.refit
    if state.found:
        there = begun.base.hypothesis
        start = hypothesis(replace(data, anchor=None), there.model.effects, there.values())
        data, base = converged(replace(data, anchor=None), start, None, progress.stopped)
    found = replace(begun, data=data, base=base, validation=state.validation, known=None)
    last = [r for r in state.rounds[-1:] if r.accepted is None and state.found]
    again = State(
        data, base, state.present[: state.given], state.given, [], [given_step(found)],
        state.validation, unseen=state.unseen,
    )  # fmt: skip
    look(again, options, 0, progress, also=state.found)
    state.first, state.rounds, state.steps = again.first, [*again.rounds, *last], again.steps
    if not state.found:
        state.passed.clear()
        state.data = again.data
    return found


def _climb_again(state: State, base: Refit, progress: Progress) -> bool:
    """The ladder as it would be climbed with what is in the model at the end; whether it was."""
    if state.first is None:
        return False
    climbed = retraced(
        state.data, base, state.refit, state.present[: state.given], state.found, state.first,
        state.rounds, progress.stopped,
    )  # fmt: skip
    if not climbed:
        return False
    rest = [r for r in state.rounds[-1:] if r.accepted is None and len(state.rounds) > 1]
    state.rounds = [*(c.round for c in climbed), *rest]
    del state.steps[1:]
    for one in climbed:
        state.data, state.refit = one.data, one.refit
        state.steps.append(step_of(state, one.effect, one.effect.title))
    return True


@dataclass(frozen=True)
class Climbed:
    """One step of a ladder."""

    effect: Effect
    data: Data
    """Anchored at `refit`."""
    refit: Refit
    round: DiagnosisRound
    """The ranking against the step before; of the first round with all that was tried."""


def retraced(
    data: Data,
    base: Refit,
    last: Refit,
    given: Sequence[Effect],
    found: Sequence[Effect],
    seen: Screen,
    rounds: Sequence[DiagnosisRound],
    stopped: Callable[[], bool],
) -> list[Climbed]:
    """The steps from the model as given to the last one, in the order of what each explains.

    Args:
        data: anchored at `last`, the model with `given` and `found`.
        base: the model as given at its minimum.
        seen: the screen of the first round.
        rounds: of the search; the first one's ranking is kept beside the first step's effect.

    Returns:
        Nothing where an effect was never screened against the model as given, or when stopped.
    """
    known = {s.effect.kind: s for s in seen.candidates}
    if not {e.kind for e in found} <= set(known):
        return []
    climbed: list[Climbed] = []
    before, left = base, list(found)
    # The first step stands beside what was tried then; later ones are held against the noise as
    # the last model shows it: beside all that the first one lacks they would seem to be nothing.
    noise = fit_whitener(last.errors, whitened_rows(data.experiments))
    while left:
        present = [*given, *[c.effect for c in climbed]]
        one, at, after = _next(data, last, present, left, stopped)
        if stopped():
            return []
        left.remove(one)
        around = rounds[0].ranking if rounds and not climbed else ()
        whitener = noise if climbed else seen.whitener
        both = _whitened(before, whitener), _whitened(after, whitener)
        repeated = _round(known[one.kind], seen, *both, at, around)
        climbed.append(Climbed(one, at, after, repeated))
        before = after
    return climbed


def _whitened(refit: Refit, whitener: Whitener) -> Refit:
    white, _ = whitened(refit.hypothesis, refit.descended, whitener)
    return replace(refit, white_cost=white)


def _next(
    data: Data,
    last: Refit,
    present: Sequence[Effect],
    left: Sequence[Effect],
    stopped: Callable[[], bool],
) -> tuple[Effect, Data, Refit]:
    """Of the effects that are left the one that leaves least, with the model that it makes."""
    if len(left) == 1:
        return left[0], data, last
    values = last.hypothesis.values()
    tried = [
        (fit(hypothesis(data, [*present, e], values), None, stopped, ROUGH_ITERATIONS), e)
        for e in left
    ]
    rough, best = min(tried, key=lambda one: one[0].cost)
    at, after = converged(data, rough.hypothesis, None, stopped)
    return best, at, after


def _round(
    screened: Screened, seen: Screen, before: Refit, after: Refit, data: Data, around: Sequence
) -> DiagnosisRound:
    """The effect ranked against the step before, and what else was ranked there."""
    weighed = weigh(screened, before, after, data.count, len(seen.candidates))
    first = ranking_of(Round(seen, (weighed,), weighed, before, after, data), data)[:1]
    kind = screened.effect.kind
    return DiagnosisRound((*first, *(r for r in around if r.effect != kind)), kind)
