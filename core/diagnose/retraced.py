"""The ladder of the effects that are in the model at the end, where the search went a detour.

While several effects are missing, what comes first may be an imitation that a later one makes
needless, or that is exchanged. The set at the end is what counts; so the ladder is told as that set
would have been climbed: at each step the effect that explains most of what is left.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from core.diagnose.acceptance import Round
from core.diagnose.data import Data, hypothesis
from core.diagnose.describe import ranking_of
from core.diagnose.evidence import weigh
from core.diagnose.minimum import converged
from core.diagnose.prune import ITERATIONS
from core.diagnose.refit import Refit, fit, whitened
from core.diagnose.screen import Screen, Screened
from core.diagnose.whitening import Whitener, fit_whitener, whitened_rows
from core.effects.effect import Effect
from core.results import DiagnosisRound


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
        (fit(hypothesis(data, [*present, e], values), None, stopped, ITERATIONS), e) for e in left
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
