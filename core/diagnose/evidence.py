"""Evidence of refits: the one objective by which models are compared.

The objective is the extended BIC of whitened errors (Chen and Chen 2008): a parameter costs ln N,
and a choice among sizes, shapes and candidates twice the logarithm of their number. Beside it
stands one bar of relevance, in noise floors.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from ..diagnose.linear_screen import Screen, ScreenedCandidate
from ..estimate.fit_result import FitResult
from ..estimate.minimum import RELEVANT
from ..estimate.problem import FitData
from ..estimate.validation import UnseenChange, ValidationFit
from ..least_squares import cost_of
from ..results import Objection, Reason

TIE = 10.0
"""Difference of BIC below which two models tie; above, the evidence is called very strong (Kass and
Raftery 1995)."""

LEAST_SHARE = 0.3
"""Share of the error above the noise floor that an effect must explain where no unseen recordings
confirm it."""

WHOLE_SHARE = 0.9
"""Share of the error above the noise floor that a set must explain to be added as a whole. No set
is tried if one effect alone explains as much. Effects can hide each other; the true ones together
leave no error. A set that leaves an error only bends what is unknown."""


@dataclass(frozen=True)
class RefittedCandidate:
    """A refitted candidate compared with the base model."""

    screened: ScreenedCandidate
    refit: FitResult
    parameters: int
    """Of the effect, with those that shape it."""
    reduction: float
    """Share of the squared error above the floor that it explains, at most 1."""
    explained: float
    """Squared error explained per sample, in floors squared."""
    whitened_reduction: float
    """Reduction of the whitened squared error."""
    gain: float
    """Fall of the extended BIC; above 10 is very strong."""
    p_value: float
    unseen: float = np.nan
    """Squared error per sample on recordings that no fit uses, where that was asked."""


def price(parameters: int, count: int, choices: float) -> float:
    """What the extended BIC asks of a model with so many more parameters, chosen among so many
    choices, over `count` samples."""
    return parameters * float(np.log(max(count, 2))) + 2.0 * float(np.log(max(choices, 1.0)))


def share_above_noise(reduction: float, before: float, count: int) -> float:
    """A reduction of the cost `before`, over `count` samples, as a share of its part above the
    noise."""
    return reduction / max(before - count, 1.0)


def assess_refit(
    screened: ScreenedCandidate, base: FitResult, refit: FitResult, count: int, candidate_count: int
) -> RefittedCandidate:
    """A refit assessed against the base: `count` samples, `candidate_count` candidates in the round
    (Bonferroni, an upper bound of Holm 1979)."""
    own = len(refit.problem.unknowns) - len(base.problem.unknowns)
    own = max(own, screened.degrees_of_freedom)
    reduction = base.cost - refit.cost
    above = max(base.cost - count, reduction, RELEVANT * count)
    whitened = max(base.whitened_cost - refit.whitened_cost, 0.0)
    choices = candidate_count * screened.trial_count
    p = float(scipy.stats.chi2.sf(whitened, own)) * choices
    return RefittedCandidate(
        screened=screened, refit=refit, parameters=own, reduction=max(reduction, 0.0) / above,
        explained=reduction / count, whitened_reduction=whitened, p_value=min(p, 1.0),
        gain=whitened - price(own, count, choices),
    )  # fmt: skip


def certain(w: RefittedCandidate) -> bool:
    """Whether a candidate is significant and relevant."""
    return w.gain > TIE and w.explained >= RELEVANT


def small_share(w: RefittedCandidate) -> Objection:
    """The objection to a candidate that is certain and explains too small a share."""
    return Objection(Reason.SMALL_SHARE, share=w.reduction, p_value=w.p_value, delta_bic=w.gain)


def ranked_candidates(candidates: list[RefittedCandidate]) -> list[RefittedCandidate]:
    """Those that are relevant first, and the best first; before it the parts and special cases of
    the best that leave no relevantly larger error."""
    ranked = sorted(candidates, key=lambda w: (w.explained < RELEVANT, -w.gain))
    simpler = {id(w) for w in ranked[1:] if certain(w) and _suffices(w, ranked[0])}
    return sorted(ranked, key=lambda w: id(w) not in simpler)


def _suffices(part: RefittedCandidate, whole: RefittedCandidate) -> bool:
    """Whether an effect is a part or a special case of another one and explains as much, but for
    what its idealised law may miss."""
    effect, larger = part.screened.effect, whole.screened.effect
    if effect.kind not in (*larger.includes, *larger.special_cases):
        return False
    missed = effect.idealised**2 * part.explained
    return whole.explained - part.explained < RELEVANT + missed


def unseen_decide(
    ranked: list[RefittedCandidate], validation: Callable[[RefittedCandidate], ValidationFit | None]
) -> list[RefittedCandidate]:
    """Best first: of the certain ones first those that leave least on recordings that no fit has
    used (None: there are none), as far as these can tell. A gain of the drive and viscous friction
    do the same along some references."""
    fits = {id(w): fit for w in ranked if certain(w) and (fit := validation(w)) is not None}
    if len(fits) < 2:
        return ranked
    left = {key: cost_of(fit.errors) / fit.data.count for key, fit in fits.items()}
    best = fits[min(left, key=lambda key: left[key])]
    behind = {key for key, fit in fits.items() if UnseenChange.between(best, fit).surely_worse}
    order = sorted(ranked, key=lambda w: (id(w) not in fits, id(w) in behind))
    return [replace(w, unseen=left[id(w)]) if id(w) in left else w for w in order]


@dataclass(frozen=True)
class Refusal:
    """An effect that is certain and relevant but is rejected."""

    refitted: RefittedCandidate
    objection: Objection


@dataclass(frozen=True)
class Round:
    """Result of one round."""

    screen: Screen
    refitted: tuple[RefittedCandidate, ...]
    """Best first."""
    accepted: RefittedCandidate | None
    before: FitResult
    after: FitResult
    data: FitData
    """Anchored at `after`."""
    added: tuple[RefittedCandidate, ...] = ()
    """The effects that lead from `before` to `after`, in the order of what each explains."""
    refusals: Sequence[Refusal] = ()
    """Effects that were certain and relevant and were rejected, best first."""
    failed_refits: tuple[str, ...] = ()
    """Titles of effects whose refits could not be simulated."""

    @property
    def refused(self) -> tuple[tuple[str, Objection], ...]:
        """Why the best effect was rejected; empty if it was accepted or explains too little."""
        return tuple((r.refitted.screened.effect.title, r.objection) for r in self.refusals[:1])
