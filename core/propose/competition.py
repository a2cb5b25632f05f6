"""Laws that nobody listed compete with the listed effects that a search has added.

A listed effect takes what it can of a law that is not listed. So a law is also asked of the model
as given, and those effects alone stay that are needed beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from ..diagnose.noise_update import against_noise_alone
from ..diagnose.ranking import ranking_of
from ..diagnose.remaining_error import remaining_error
from ..diagnose.removal_and_exchange import needed_effects
from ..diagnose.search import Found, LawSearch, Move, Search
from ..diagnose.stated_results import Noise
from ..effects.effect import Effect
from ..estimate.fitted_model import FittedModel, fit_model
from ..estimate.problem import within_noise, within_tolerance
from ..estimate.validation import UnseenChange
from ..information_criteria import fall_of_bic
from ..propose.propose import laws_on
from ..results import Proposal, RankedEffect
from ..sentences import listed


def explaining_law(search: Search, found: Found) -> Found | None:
    """The model as given with a law, or with events, that leaves no more than noise, of unseen
    recordings as well, where what a search has added leaves more; else None."""
    last = against_noise_alone(found.model, search.options) or found.model
    if search.progress.stopped() or not _leaves_more_than_noise(search, last):
        return None
    first = found.path[0]
    given = _as_given(last, first.model, search.progress.stopped)
    answer = laws_on(search, given, _ranking(search, first.model), clear=True)
    explained = answer.grown is not None and not _leaves_more_than_noise(search, answer.grown)
    if not (answer.proposal.events or explained):
        return None
    return _given_with(first, given, _without(answer.proposal, search, last))


def _given_with(first: Move, given: FittedModel, proposal: Proposal) -> Found:
    return Found((first._replace(model=given),), (), proposal)


def competing_laws(search: Search, found: Found) -> Found:
    """Where a search ends if laws compete with what it has added; without a proposal where nothing
    is left to explain, or where listed effects are still to be added first. The model as given with
    a law is kept where it is better than the one with all that was added."""
    last = against_noise_alone(found.model, search.options) or found.model
    if search.progress.stopped() or not _leaves_more_than_noise(search, last):
        return found
    seen = found._replace(path=(*found.path[:-1], found.path[-1]._replace(model=last)))
    if search.added(last):
        other = _instead_of_added(search, seen)
        if other is not None:
            return other
    if found.proposed or (search.added(last) and not search.options.adds):
        return found
    answer = laws_on(search, last, _ranking(search, last))
    tolerated = within_tolerance(last.data, last.refit.errors)
    if tolerated and answer.grown is None and not answer.proposal.events:
        return found
    return (found if answer.grown is None else seen)._replace(proposal=answer.proposal)


def _instead_of_added(search: Search, found: Found) -> Found | None:
    """The model as given with a law, and with those of the added effects that are needed beside it;
    None where what was added is better, or all of it is needed."""
    last, first, stopped = found.model, found.path[0], search.progress.stopped
    given = _as_given(last, first.model, stopped)
    answer = laws_on(search, given, _ranking(search, first.model))
    if answer.proposal.events:
        return _given_with(first, given, _without(answer.proposal, search, last))
    if answer.grown is None or not _is_better(search, answer.grown, last):
        return None
    listed_effects = _needed_beside(search, answer.grown, last)
    kept = [e for e in search.added(last) if e in listed_effects]
    if len(kept) == len(search.added(last)):
        return None
    if not kept:
        return _given_with(first, given, _without(answer.proposal, search, last))
    values = last.refit.problem.all_values()
    model = fit_model(last.data, (*search.memo.stated, *kept), values, stopped)
    answer = laws_on(search, model, _ranking(search, first.model))
    if answer.grown is None:
        return None
    move = Move(model, listed([e.title for e in kept]), tuple(e.kind for e in kept))
    path = (first._replace(model=given), move)
    return Found(path, (), _without(answer.proposal, search, last, kept))


def _without(
    proposal: Proposal, search: Search, last: FittedModel, kept: Sequence[Effect] = ()
) -> Proposal:
    """The proposal with what a search had added that is needless beside the first law."""
    gone = tuple(e.title for e in search.added(last) if e not in kept)
    return replace(proposal, needless=gone)


def _leaves_more_than_noise(search: Search, model: FittedModel) -> bool:
    """Whether a model leaves more than noise, of the recordings that it was fitted to or of
    others."""
    unseen = search.memo.validation_fit(model)
    law_errors = model.with_law_errors.data.law_errors
    seen_by = (model.data, model.refit.errors)
    each = (seen_by,) if unseen is None else (seen_by, (unseen.data, unseen.errors))
    return any(
        remaining_error(replace(data, law_errors=law_errors), errors).above for data, errors in each
    )


def _as_given(last: FittedModel, first: FittedModel, stopped: Callable[[], bool]) -> FittedModel:
    """The model as given, with the bending shapes and against the noise of the last one."""
    if first.data.bare is last.data.bare:
        return first.against(last.data)
    return fit_model(last.data, first.effects, first.refit.problem.all_values(), stopped)


def _is_better(search: Search, grown: FittedModel, last: FittedModel) -> bool:
    """Whether a model with a law is better than the last one without: by unseen recordings if they
    decide, else by the evidence against one noise."""
    before, after = (search.memo.validation_fit(m) for m in (last, grown))
    if before is not None and after is not None:
        change = UnseenChange.between(before, after)
        if change.surely_better or change.surely_worse:
            return change.surely_better
    least = min((grown, last), key=lambda m: m.refit.cost)
    noise = Noise.of(last.data, least.refit.errors)
    left, right = (noise.left(m.data, m.refit) for m in (last, grown))
    fall = fall_of_bic(left, right, noise.products)
    return fall is not None and fall > 0.0


def _needed_beside(search: Search, grown: FittedModel, last: FittedModel) -> tuple[Effect, ...]:
    """What is needed of the added effects beside a law, which stands before them and so stays."""
    if within_noise(grown.data, grown.refit.errors):
        return ()
    stopped, law = search.progress.stopped, grown.effects[-1]
    effects = (*search.memo.stated, law, *search.added(last))
    values = {**last.refit.problem.all_values(), **grown.refit.problem.all_values()}
    whole = fit_model(last.data, effects, values, stopped)
    count = len(search.memo.stated) + 1
    return needed_effects(whole.data, whole.refit, effects, count, stopped).effects


def _ranking(search: Search, model: FittedModel) -> tuple[RankedEffect, ...]:
    """The listed effects as ranked on a model; empty if they were not."""
    known = search.memo.rounds.get(model.key)
    return () if known is None else ranking_of(known.round, known.model.data)


LAWS = LawSearch(explaining_law, competing_laws)
"""Laws that compete with the listed effects."""
