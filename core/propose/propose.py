"""The law of what no listed effect explains: carriers, short laws, refits."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import zip_longest
from typing import NamedTuple

import numpy as np

from ..diagnose.base_fit import BaseFit
from ..diagnose.evidence import LEAST_SHARE, WHOLE_SHARE, RefittedCandidate, Round, certain
from ..diagnose.memo import Memo
from ..diagnose.next_experiment import next_experiments, possible_experiments
from ..diagnose.remaining_error import remaining_error
from ..diagnose.removal_and_exchange import needed_effects
from ..diagnose.search import Search
from ..diagnose.search_options import Options
from ..diagnose.search_round import REFITTED
from ..diagnose.stated_results import Noise, estimates
from ..errors import InputError
from ..estimate.fit_result import FitResult, with_robust_covariance
from ..estimate.fitted_model import FittedModel
from ..estimate.problem import parameter_names, within_tolerance
from ..estimate.validation import UnseenChange, ValidationFit
from ..information_criteria import fall_of_bic
from ..least_squares import cost_of
from ..processors import fast_thread_switching
from ..progress import Progress, Silent
from ..propose.carriers import SmoothFunction, smooth_functions
from ..propose.events import events_in
from ..propose.short_laws import (
    Law,
    ShortLaw,
    carrier_of,
    different_laws,
    law_term,
    logarithm,
    short_laws,
)
from ..propose.targets import targets
from ..propose.variables import COARSE, FINE, actual_motions
from ..results import (
    Carrier,
    Event,
    PlannedExperiment,
    Proposal,
    ProposedLaw,
    RankedEffect,
)
from ..results.proposal import NO_CARRIER, NO_LAW, WITHIN_NOISE

MOST_CARRIERS = 3
"""Variables whose functions are looked at more closely, and laws that are proposed."""

MOST_CLOSE = 8
"""Variables whose short laws are compared."""

MOST_LAWS = 4
"""Short laws that are refitted."""

CLOSE = 0.3
"""In the logarithm of the share that is left: two laws that leave about as much."""


@fast_thread_switching()
def propose(
    fitted: BaseFit, options: Options | None = None, progress: Progress | None = None,
    ranking: Sequence[RankedEffect] = (), added: int = 0,
) -> Proposal:  # fmt: skip
    """One to three laws for the error that a fitted model leaves, or why there is none.

    Args:
        fitted: The model as it stands, with the recordings that no fit uses.
        options: Of the diagnosis before it.
        progress: Gets each stage; asked whether to stop.
        ranking: The listed effects as ranked on this model, to name the one most like a law.
        added: How many of the model's effects, the last, a search has found: those that a law makes
            needless are named.
    """
    progress = progress or Silent()
    effects = tuple(fitted.base.problem.model.effects)
    memo = Memo(fitted.validation, effects[: len(effects) - added], fitted.data.bare.arm.modes)
    search = Search(options or Options(), progress, None, memo)
    return laws_on(search, FittedModel(fitted.data, fitted.base, effects), ranking).proposal


class Answer(NamedTuple):
    """What a search for laws on a model has found."""

    proposal: Proposal
    grown: FittedModel | None
    """The model with the first law."""


@fast_thread_switching()
def laws_on(
    search: Search, model: FittedModel, ranking: Sequence[RankedEffect] = (), *, clear: bool = False
) -> Answer:
    """Laws for what a model leaves; `ranking`: the listed effects as ranked on it. `clear`: only
    where one variable carries nearly everything."""
    clock = time.perf_counter()
    answer = _Proposing(search, model, ranking, clear).run()
    proposal = replace(
        answer.proposal, seconds=time.perf_counter() - clock, stopped=search.progress.stopped()
    )
    return answer._replace(proposal=proposal)


class _Proposing:
    """One search for laws."""

    def __init__(
        self, search: Search, model: FittedModel, ranking: Sequence[RankedEffect], clear: bool
    ) -> None:
        self.model, self.search, self.ranking, self.clear = model, search, ranking, clear
        self.motions = actual_motions(model)
        self.progress, self.memo = search.progress, search.memo
        self.stated = len(self.memo.stated)

    def run(self) -> Answer:
        """The whole search."""
        model = self.model
        if not remaining_error(model.data, model.refit.errors).above:
            return Answer(Proposal(reason=WITHIN_NOISE), None)
        functions = self._carriers()
        carriers = tuple(carrier_of(f) for f in functions[:REFITTED])
        events = self._events(functions)
        if events:
            return Answer(Proposal(carriers, events=events), None)
        tolerated = within_tolerance(model.data, model.refit.errors)
        least = WHOLE_SHARE if tolerated or self.clear else LEAST_SHARE
        if not functions or functions[0].share < least or self.progress.stopped():
            return Answer(Proposal(carriers, reason=NO_CARRIER), None)
        laws = self._short_laws(functions)
        if self.progress.stopped():
            return Answer(Proposal(carriers, reason=NO_LAW), None)
        answer, close = self._tried(carriers, laws), logarithm(functions[0].left) + CLOSE
        alike = sum(logarithm(f.left) <= close for f in functions[1:REFITTED])
        return answer._replace(proposal=replace(answer.proposal, alike=alike))

    def _carriers(self) -> list[SmoothFunction]:
        """All functions of one variable, best first."""
        places = targets(self.model)
        self.progress.stage("Asking what the rest depends on", len(places))
        functions: list[SmoothFunction] = []
        for target in places:
            self.progress.advance(0, f"At {target.title}")
            choices, stopped = target.choices(self.model, self.motions), self.progress.stopped
            functions += smooth_functions(self.model, target, choices, stopped=stopped)
            self.progress.advance(1)
            if self.progress.stopped():
                break
        best: dict[tuple[str, str, str], SmoothFunction] = {}
        for f in sorted(functions, key=lambda f: -f.share):  # one of several ways of a bristle
            best.setdefault((f.target.name, f.variable.word, f.factor.words), f)
        return list(best.values())

    def _events(self, functions: Sequence[SmoothFunction]) -> tuple[Event, ...]:
        """What happened once in each recording, where no variable carries nearly everything."""
        if (functions and functions[0].share >= WHOLE_SHARE) or self.progress.stopped():
            return ()
        self.progress.stage("Asking whether something happened once in each recording", None)
        return events_in(self.model, self.progress.stopped, self.memo.validation_fit)

    def _short_laws(self, functions: Sequence[SmoothFunction]) -> list[Law]:
        """The laws that are refitted: the best of each of the best variables first."""
        close = functions[:MOST_CLOSE]
        self.progress.stage("Looking for short laws", len(close) + MOST_CARRIERS)
        # Without a simulation; hats that lie closer together, for the best of them alone.
        coarse = [(f, law) for f in close for law in self._laws_of(f, roughly=True)[:1]]
        best = sorted(coarse, key=lambda pair: pair[1].penalised_error)[:MOST_CARRIERS]
        each = [self._laws_of(self._finer(f)) for f, _ in best]
        in_turn = [law for laws in zip_longest(*each) for law in laws if law is not None]
        singles = [Law((law,)) for law in different_laws(in_turn, MOST_LAWS)]
        return [*self._sums(functions[0]), *singles][:MOST_LAWS]

    def _sums(self, first: SmoothFunction) -> list[Law]:
        """The law of two functions, where none alone carries nearly everything: of one variable
        forwards and backwards, or of a second variable at the same target."""
        if first.share >= WHOLE_SHARE or self.progress.stopped():
            return []
        self.progress.stage("Asking for a second variable", None)
        pairs = [*self._second(first), *self._by_direction()]
        best = min(pairs, key=lambda f: f.left, default=None)
        if best is None or logarithm(best.left) > logarithm(first.left) - CLOSE:
            return []
        assert best.beside is not None
        return [Law((self._beside(best.beside, best), self._beside(best, best.beside)))]

    def _second(self, first: SmoothFunction) -> list[SmoothFunction]:
        """Functions beside the first one. A formula may have one state, such as friction's."""
        choices = first.target.choices(self.model, self.motions)
        stopped = self.progress.stopped
        found = smooth_functions(self.model, first.target, choices, COARSE, stopped, first)
        return [f for f in found if len(f.states | first.states) < 2]

    def _by_direction(self) -> list[SmoothFunction]:
        """Functions of moving backwards beside those of moving forwards."""
        found = []
        for target in targets(self.model):
            for x, forwards, backwards in target.by_direction(self.model, self.motions):
                (first,) = smooth_functions(self.model, target, [(x, forwards)])
                found += smooth_functions(self.model, target, [(x, backwards)], beside=first)
        return found

    def _beside(self, f: SmoothFunction, other: SmoothFunction) -> ShortLaw:
        """The best short law of a function, beside the other."""
        choices, alone = [(f.variable, f.factor)], replace(other, beside=None)
        return short_laws(smooth_functions(self.model, f.target, choices, FINE, beside=alone)[0])[0]

    def _laws_of(self, f: SmoothFunction, *, roughly: bool = False) -> list[ShortLaw]:
        if self.progress.stopped():
            return []
        self.progress.advance(1, f"{f.factor.noun} at {f.target.title} over the {f.variable.title}")
        return short_laws(f, roughly=roughly)

    def _finer(self, f: SmoothFunction) -> SmoothFunction:
        """The function with FINE knots."""
        if len(f.knots) >= FINE:
            return f
        return smooth_functions(self.model, f.target, [(f.variable, f.factor)], FINE)[0]

    def _tried(self, carriers: tuple[Carrier, ...], laws: Sequence[Law]) -> Answer:
        """The laws as candidates of one more round."""
        arm, taken = self.model.data.bare.arm, set(self.model.refit.problem.model.parameters)
        by_kind = {f"law_{i + 1}": law for i, law in enumerate(laws)}
        effects = []
        for kind, law in by_kind.items():
            with suppress(InputError):  # such as a force that is not smooth at rest
                effects.append(law.effect(arm, kind, taken))
        found = self.search.round_of(self.model, effects, "Trying the laws in the model", 1)
        refused = tuple((r.refitted.screened.effect.title, r.objection) for r in found.refusals)
        if found.accepted is None:
            return Answer(Proposal(carriers, reason=NO_LAW, refused=refused), None)
        chosen = self._chosen(found, by_kind)
        noise = Noise.of(found.data, found.screen.remainders)
        stated = tuple(self._law(w, refit, by_kind, noise) for w, refit in chosen)
        needless = self._needless(found)
        experiments = self._experiments(chosen)
        proposal = Proposal(carriers, stated, "", refused, experiments, needless)
        own = found.accepted.screened.effect
        return Answer(proposal, FittedModel(found.data, found.after, (*self.model.effects, own)))

    def _needless(self, found: Round) -> tuple[str, ...]:
        """Titles of the effects that came in before the first law and are not needed beside it."""
        best = found.accepted
        assert best is not None
        # The law stands before what was added, so that it stays.
        given, added = self.model.effects[: self.stated], self.model.effects[self.stated :]
        effects = (*given, best.screened.effect, *added)
        stopped, count = self.progress.stopped, self.stated + 1
        kept = needed_effects(found.data, found.after, effects, count, stopped).effects
        return tuple(e.title for e in added if e not in kept)

    def _chosen(
        self, found: Round, by_kind: dict[str, Law]
    ) -> list[tuple[RefittedCandidate, FitResult]]:
        """The accepted law, and others that explain about as much and are another function."""
        best = found.accepted
        assert best is not None
        refused = {id(r.refitted.screened) for r in found.refusals}
        chosen = [(best, found.after)]
        noise = not remaining_error(found.data, found.after.errors).above
        for w in found.refitted:
            close = logarithm(1.0 - w.reduction) <= logarithm(1.0 - best.reduction) + CLOSE
            close = close and certain(w) and w.reduction >= LEAST_SHARE
            close = close and not (noise and remaining_error(found.data, w.refit.errors).above)
            close = close and not self._unseen(w.refit) > self._unseen(self.model.refit)
            new = w.screened is not best.screened and id(w.screened) not in refused
            wanted = close and new and len(chosen) < MOST_CARRIERS
            if wanted and not self._refuted(found.after, w.refit):
                chosen.append((w, with_robust_covariance(w.refit)))
        return chosen

    def _law(
        self, w: RefittedCandidate, refit: FitResult, by_kind: dict[str, Law], noise: Noise
    ) -> ProposedLaw:
        law, data, own = by_kind[w.screened.effect.kind], self.model.data, w.screened.effect
        names = parameter_names(own, refit.problem.model, data.sizes)
        left, count = noise.left(data, refit), data.count
        stated = {e.name: e for e in estimates(refit)}
        at = law.with_values([stated[name].value for name in names])
        relative, likeness = self._relative(refit)
        grown = FittedModel(data, refit, (*self.model.effects, own))
        fall = fall_of_bic(noise.left(data, self.model.refit), left, noise.products)
        return ProposedLaw(
            title=own.title, target=law.target, formula=at.formula(names),
            latex=own.formula, parameters=tuple(stated[name] for name in names),
            terms=tuple(law_term(term, grown, names) for term in at.terms), explained=w.reduction,
            rms=(math.sqrt(self.model.refit.cost / count), math.sqrt(refit.cost / count)),
            unseen_rms=(self._unseen(self.model.refit), self._unseen(refit)),
            delta_bic=w.gain if fall is None else fall, relative=relative,
            likeness=likeness, left=left,
        )  # fmt: skip

    def _refuted(self, best: FitResult, other: FitResult) -> bool:
        """Whether another law surely leaves more of unseen recordings than the best one."""
        before, after = self._validated(best), self._validated(other)
        if before is None or after is None:
            return False
        return UnseenChange.between(before, after).surely_worse

    def _unseen(self, refit: FitResult) -> float:
        """rms on validation recordings in noise floors; NaN without any."""
        fitted = self._validated(refit)
        return math.sqrt(cost_of(fitted.errors) / fitted.data.count) if fitted else math.nan

    def _validated(self, refit: FitResult) -> ValidationFit | None:
        return self.memo.validation_fit(FittedModel(self.model.data, refit, ()))

    def _relative(self, refit: FitResult) -> tuple[str, float]:
        """The listed effect whose prediction is most like the law's, and the cosine."""
        change = [a - b for a, b in zip(self.model.refit.errors, refit.errors, strict=True)]
        best, most = "", float("nan")
        for ranked in self.ranking:
            if len(ranked.predicted) != len(change):
                continue
            cosine = abs(_cosine(ranked.predicted, change))
            if not cosine <= most:
                best, most = (ranked.title, cosine) if np.isfinite(cosine) else (best, most)
        return best, most

    def _experiments(
        self, chosen: Sequence[tuple[RefittedCandidate, FitResult]]
    ) -> tuple[PlannedExperiment, ...]:
        specs = possible_experiments(self.model.data)
        if len(chosen) < 2 or not specs or self.progress.stopped():
            return ()
        self.progress.stage("Planning the experiment that decides", None)
        first, second = (refit.problem for _, refit in chosen[:2])
        one, other = (w.screened.effect.title for w, _ in chosen[:2])
        stopped = self.progress.stopped
        return next_experiments(self.model.data, first, second, (one, other), specs, stopped)


def _cosine(a: Sequence[np.ndarray], b: Sequence[np.ndarray]) -> float:
    product = sum(float(np.sum(x * y)) for x, y in zip(a, b, strict=True))
    size = math.sqrt(cost_of(a) * cost_of(b))
    return product / size if size else float("nan")
