"""The ladder as it is stated: one noise, and effects in the order of what they explain.

While several effects are missing, the first one found may be an imitation that is later taken out
or exchanged. So each rung holds one more effect of the last model: the one that explains most of
what is left. Models that the search has fitted are rungs as they are, seen against the last noise;
a missing one is one more fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from ..diagnose.evidence import Round, assess_refit
from ..diagnose.linear_screen import screen
from ..diagnose.memo import Memo, ModelRound
from ..diagnose.next_experiment import deciding_experiments
from ..diagnose.ranking import ranking_of
from ..diagnose.search import Found
from ..diagnose.stated_results import Noise, ladder_step
from ..effects.effect import Effect
from ..estimate.fit_result import fit, with_whitened_cost
from ..estimate.fitted_model import FittedModel, fit_model, weight_ratios, weighted
from ..estimate.problem import FitData, parameter_names, problem_of
from ..estimate.starts import ROUGH_ITERATIONS
from ..progress import Progress
from ..results import DiagnosisRound, LadderStep, RankedEffect
from ..sentences import listed


@dataclass(frozen=True)
class Rung:
    """A model of the ladder, and what was tried on the one before."""

    model: FittedModel
    added: Effect | None
    tried: DiagnosisRound | None = None


@dataclass(frozen=True)
class Ladder:
    """From the model as given to the last one, all against one noise."""

    rungs: tuple[Rung, ...]
    rounds: tuple[DiagnosisRound, ...]
    """One per added effect, and the one that found nothing more."""
    noise: Noise

    def ending(self, last: FittedModel) -> Ladder:
        """The same with its last model as it is stated."""
        return replace(self, rungs=(*self.rungs[:-1], replace(self.rungs[-1], model=last)))

    def as_given(self) -> Ladder:
        """That of the model as given alone, with its ranking."""
        rounds = tuple(replace(r, accepted=None) for r in self.rounds[:1])
        return replace(self, rungs=self.rungs[:1], rounds=rounds)

    @property
    def added(self) -> tuple[str, ...]:
        """Ids of the effects that were added, in this order."""
        return tuple(rung.added.kind for rung in self.rungs if rung.added is not None)

    def steps(self, memo: Memo) -> tuple[LadderStep, ...]:
        """The error of each model on estimation and validation recordings."""
        return tuple(
            replace(_step(rung, memo), left=self.noise.left(rung.model.data, rung.model.refit))
            for rung in self.rungs
        )


def ladder(found: Found, memo: Memo, progress: Progress) -> Ladder:
    """The ladder to the last model of a search."""
    last, first = found.model, found.path[0].model
    base, noise = first.against(last.data), _noise(memo, last)
    if base.key == last.key:
        # Effects that went again can have brought the model to a better minimum.
        better = last if last.refit.cost <= base.refit.cost else base
        tried = _tried(memo, better, last.data, progress, None, noise)
        return Ladder((Rung(better, None),), (tried,) if tried else (), noise)
    rungs, remaining = [Rung(base, None)], list(last.effects[len(memo.stated) :])
    grown = {} if any(move.removed for move in found.path) else _grown(found)
    while remaining and not progress.stopped():
        before = rungs[-1].model
        effect, model = grown.get(before.key) or _strongest(last, before, remaining, progress)
        remaining.remove(effect)
        tried = _tried(memo, before, last.data, progress, effect.kind, noise)
        refitted = {r.effect for r in tried.ranking if r.delta_bic is not None} if tried else ()
        if tried is None or effect.kind not in refitted:
            ranked = tried.ranking if tried else ()
            tried = _assembled(memo.rounds[first.key], before, model, effect, noise, ranked)
        rungs.append(Rung(model.against(last.data), effect, tried))
    rounds = [rung.tried for rung in rungs if rung.tried is not None]
    unaccepted = _tried(memo, last, last.data, progress, None, noise)
    return Ladder(tuple(rungs), (*rounds, *([unaccepted] if unaccepted else [])), noise)


def _noise(memo: Memo, last: FittedModel) -> Noise:
    """What neither the last model nor, where they were tried on it, any candidate explains."""
    known = memo.rounds.get(last.key)
    if known is None:
        return Noise.of(last.data, last.refit.errors)
    ratios = weight_ratios(known.model.data, last.data)
    remainders = known.round.screen.remainders
    return Noise.of(last.data, [r * x for r, x in zip(remainders, ratios, strict=True)])


def _grown(found: Found) -> dict[tuple[str, ...], tuple[Effect, FittedModel]]:
    """Key of a model -> the effect that came in next, and the model with it, where a search has
    added one effect after the other."""
    pairs = {}
    for before, after in pairwise(found.path):
        if len(after.added) != 1:
            return {}
        effect = next(e for e in after.model.effects if e.kind == after.added[0])
        pairs[before.model.key] = effect, after.model
    return pairs


def _strongest(
    last: FittedModel, before: FittedModel, remaining: Sequence[Effect], progress: Progress
) -> tuple[Effect, FittedModel]:
    """The effect that leaves the least error, and the model with it."""
    if len(remaining) == 1:
        return remaining[0], last
    values = last.refit.problem.values()
    refits = [
        (fit(problem_of(last.data, [*before.effects, e], values), None, progress.stopped,
             ROUGH_ITERATIONS), e)
        for e in remaining
    ]  # fmt: skip
    rough, best = min(refits, key=lambda pair: pair[0].cost)
    effects, start = (*before.effects, best), rough.problem.values()
    return best, fit_model(last.data, effects, start, progress.stopped)


def _tried(
    memo: Memo, model: FittedModel, like: FitData, progress: Progress, accepted: str | None,
    noise: Noise,
) -> DiagnosisRound | None:  # fmt: skip
    """What was tried on a model, against the noise of `like`; None if nothing was."""
    known = memo.rounds.get(model.key)
    if known is None:
        return None
    found = _seen_in(known, like, noise)
    ranking = ranking_of(found, found.data, noise)
    experiments = deciding_experiments(found, ranking, found.data, progress)
    not_simulated = tuple(dict.fromkeys((*found.screen.diverged, *found.failed_refits)))
    return DiagnosisRound(ranking, accepted, tuple(found.refused), not_simulated, experiments)


def _seen_in(known: ModelRound, like: FitData, noise: Noise) -> Round:
    """What was tried on a model, with its refits against the noise of `like`."""
    model, old, found = known.model.against(like), known.model.data, known.round
    if model is known.model:
        return found
    data, candidates = model.data, len(found.screen.candidates)
    before = with_whitened_cost(model.refit, noise.whitener)
    refitted = []
    for w in found.refitted:
        refit = with_whitened_cost(weighted(w.refit, old, data), noise.whitener)
        assessed = assess_refit(w.screened, before, refit, data.count, candidates)
        refitted.append(replace(assessed, unseen=w.unseen))
    return replace(found, refitted=tuple(refitted), before=before, after=before, data=data)


def _assembled(
    first: ModelRound, before: FittedModel, after: FittedModel, effect: Effect, noise: Noise,
    others: Sequence[RankedEffect],
) -> DiagnosisRound:  # fmt: skip
    """The effect ranked against the model before, beside the other ranks there."""
    data = after.data
    screened = first.round.screen
    own = next((s for s in screened.candidates if s.effect.kind == effect.kind), None)
    if own is None:  # it came in as the simpler part of a candidate, and is none itself
        screened = screen(data, before.refit.problem, before.effects, [effect])
        (own,) = screened.candidates
    old, new = (with_whitened_cost(m.refit, noise.whitener) for m in (before, after))
    assessed = assess_refit(own, old, new, data.count, len(screened.candidates))
    record = Round(screened, (assessed,), assessed, before.refit, after.refit, data)
    kept = (r for r in others if r.effect != effect.kind)
    return DiagnosisRound((*ranking_of(record, data, noise)[:1], *kept), effect.kind)


def _step(rung: Rung, memo: Memo) -> LadderStep:
    """The error of a rung's model on estimation and validation recordings."""
    model, added = rung.model, rung.added
    names: tuple[str, ...] = ()
    if added is not None:
        names = parameter_names(added, model.refit.problem.model, model.data.sizes)
        title = added.title
    else:
        stated = listed([e.title for e in model.effects])
        title = f"The model with {stated}" if stated else "The model as given"
    kind = None if added is None else added.kind
    return ladder_step(model.data, memo.validation_fit(model), model.refit, kind, title, names)
