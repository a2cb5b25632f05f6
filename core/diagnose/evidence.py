"""Evidence from cost reductions: explained share, significance, ranking.

A size at its plausible bound is evidence against its effect: what needs a larger one is something
else.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy

from ..diagnose.fit_problem import FitProblem, ParametrisedModel
from ..diagnose.linear_screen import ScreenedCandidate
from ..diagnose.refit import Refit
from ..effects.sizes import typical
from ..least_squares import GOOD_ENOUGH, SEEN, normal_equations, pseudo_inverse, with_prior
from ..parameters import Parameter
from ..results import ABOVE, Objection, Reason

SIGNIFICANCE = 0.01
"""Family-wise error of the significance test, over all candidates of a round."""

LEAST_SHARE = 0.3
"""Share of the error above the noise floor that must be explained for an effect to be accepted: by
it alone, or by a set that explains most of it. Four equal effects explain a quarter each."""

RELEVANT = 0.04
"""Least explained squared error per sample, in squared noise floors: 0.2 of the noise floor's rms.
With thousands of samples far less is significant, but not relevant."""

PARAMETER_PRICE = 0.05
"""Price per parameter in log(1 - reduction): of two effects that explain the same, the simpler one
ranks first."""


CLOSE = 0.3
"""In penalised error: refits within this distance are ranked by their whitened evidence."""

AT_BOUND = 0.05
"""Of a plausible size: this close to the bound next to neutral an effect has vanished."""

TIE = 10.0
"""Difference of BIC below which two refits tie; above, the evidence is called very strong (Kass and
Raftery 1995)."""

NEGLIGIBLE = 0.02
"""Share of the error above the noise floor below which nothing is left to explain."""


@dataclass(frozen=True)
class RefittedCandidate:
    """A refitted candidate compared with the base model."""

    screened: ScreenedCandidate
    refit: Refit
    parameters: int
    """Of the effect, with those that shape it."""
    reduction: float
    """Share of the squared error above the floor that it explains, at most 1."""
    explained: float
    """Squared error explained per sample, in floors squared."""
    whitened_reduction: float
    """Reduction of the whitened squared error."""
    delta_bic: float
    """`whitened_reduction` minus the price of the parameters; above 10 is very strong."""
    p_value: float
    unseen: float = np.nan
    """Squared error per sample on recordings that no fit uses, where that was asked."""

    @property
    def penalised_error(self) -> float:
        """Logarithm of 1 - reduction plus the price of the parameters; the smallest is best."""
        return _penalised_error(self.reduction, self.parameters)


def share_above_noise(reduction: float, before: float, count: int) -> float:
    """A reduction of the cost `before`, over `count` samples, as a share of its part above the
    noise."""
    return reduction / max(before - count, 1.0)


def _penalised_error(reduction: float, parameters: int) -> float:
    return float(np.log(max(1.0 - reduction, NEGLIGIBLE))) + PARAMETER_PRICE * parameters


def _above(base: float, reduction: float, count: int) -> float:
    """The squared error that a reduction is a share of."""
    return max(base - count, reduction, RELEVANT * count)


def penalised_error(base: float, cost: float, count: int, parameters: int) -> float:
    """Penalised error of a refit with squared error `cost`, and `base` before, over `count`
    samples."""
    reduction = base - cost
    if not np.isfinite(reduction):
        return np.inf
    return _penalised_error(max(reduction, 0.0) / _above(base, reduction, count), parameters)


def assess_refit(
    screened: ScreenedCandidate, base: Refit, refit: Refit, count: int, candidate_count: int
) -> RefittedCandidate:
    """A refit assessed against the base: `count` samples, `candidate_count` candidates in the round
    (Bonferroni, an upper bound of Holm 1979)."""
    own = len(refit.parametrised.unknowns) - len(base.parametrised.unknowns)
    own = max(own, screened.degrees_of_freedom)
    reduction = base.cost - refit.cost
    above = _above(base.cost, reduction, count)
    whitened = max(base.whitened_cost - refit.whitened_cost, 0.0)
    p = float(scipy.stats.chi2.sf(whitened, own)) * candidate_count * screened.trial_count
    return RefittedCandidate(
        screened=screened, refit=refit, parameters=own, reduction=max(reduction, 0.0) / above,
        explained=reduction / count, whitened_reduction=whitened, p_value=min(p, 1.0),
        delta_bic=whitened - own * float(np.log(count)),
    )  # fmt: skip


def certain(w: RefittedCandidate) -> bool:
    """Whether a candidate is significant and relevant."""
    return w.p_value < SIGNIFICANCE and w.delta_bic > TIE and w.explained >= RELEVANT


def acceptable(w: RefittedCandidate, part: bool = False) -> bool:
    """Whether a candidate is certain and explains a sufficient share of the error above the noise
    floor: alone, or as `part` of a set that does."""
    return certain(w) and (part or w.reduction >= LEAST_SHARE)


def small_share(w: RefittedCandidate) -> Objection:
    """The objection to a candidate that is certain and explains too small a share."""
    return Objection(
        Reason.SMALL_SHARE, share=w.reduction, p_value=w.p_value, delta_bic=w.delta_bic
    )


def ranked_candidates(candidates: list[RefittedCandidate]) -> list[RefittedCandidate]:
    """Best first. The penalised error decides; among close ones the whitened evidence; among ties
    of that the fewest parameters. A part or a special case of the best comes before it if it is no
    worse."""
    best = min((w.penalised_error for w in candidates), default=0.0)
    close = [w for w in candidates if w.penalised_error <= best + CLOSE]
    others = [w for w in candidates if w.penalised_error > best + CLOSE]
    most = max((w.delta_bic for w in close), default=0.0)
    level = [w for w in close if w.delta_bic > most - TIE]
    below = [w for w in close if w.delta_bic <= most - TIE]
    return _parts_first(
        sorted(level, key=lambda w: (w.parameters, -w.delta_bic))
        + sorted(below, key=lambda w: -w.delta_bic)
        + sorted(others, key=lambda w: w.penalised_error)
    )


def unseen_decide(
    ranked: list[RefittedCandidate], unseen: Callable[[RefittedCandidate], float | None]
) -> list[RefittedCandidate]:
    """Best first: of those that explain about as much as the first, those before the others that
    leave the least `unseen` error, squared, on recordings that no fit has used (None: there are
    none). A gain of the drive and viscous friction do the same along some references."""
    most = ranked[0].penalised_error + CLOSE
    close = [w for w in ranked if w.penalised_error <= most and acceptable(w)]
    errors = {w.screened.effect.kind: unseen(w) for w in close} if len(close) > 1 else {}
    known = {kind: x for kind, x in errors.items() if x is not None}
    if not known:
        return ranked
    limit = WORSE**2 * min(known.values())
    seen = [replace(w, unseen=known.get(w.screened.effect.kind, np.nan)) for w in ranked]
    return sorted(seen, key=lambda w: not w.unseen <= limit)


WORSE = 1.1
"""Ratio of validation errors from which one is worse: above what refitted starts and noise change
it (1.02 in recordings of an independent engine)."""


def _parts_first(candidates: list[RefittedCandidate]) -> list[RefittedCandidate]:
    """Parts and special cases of the best effect first, if they are no worse. While a second effect
    is missing, the extra sizes of the larger effect take up some of it; they have their turn in the
    next round."""
    largest = candidates[0].screened.effect if candidates else None
    parts = [
        w
        for w in candidates[1:]
        if largest is not None
        and w.screened.effect.kind in (*largest.includes, *largest.special_cases)
        and w.penalised_error <= candidates[0].penalised_error
        and acceptable(w)
    ]
    kinds = {w.screened.effect.kind for w in parts}
    return parts + [w for w in candidates if w.screened.effect.kind not in kinds]


def ended_at_bound(after: Refit, data: FitProblem, before: Refit) -> Objection | None:
    """An objection of the first size that is pressed against its bound far from neutral, or
    None."""
    return next((objection for _, objection in at_bounds(after, data, before)), None)


def at_bounds(after: Refit, data: FitProblem, before: Refit) -> list[tuple[str, Objection]]:
    """(effect, objection) of each size that the recordings press against its bound far from
    neutral, unless a person stated the bound or the model `before` stood at it already: that says
    nothing of what was added.

    The predicted reduction beyond the bound must be one that a descent continues for; near the
    noise floor, a relevant one.
    """
    h = after.parametrised
    not_new = data.bounded | _names_at_bounds(before.parametrised)
    least = GOOD_ENOUGH if after.cost > ABOVE**2 * data.count else RELEVANT
    effect_parameters = {
        k.parameter.name: (effect.kind, k.neutral)
        for effect in h.model.effects
        for k in effect.parameters(h.model.arm, h.model.drive, typical(h.model.arm))
        if not k.secondary and k.parameter.name not in not_new
    }
    return [
        (effect_parameters[u.parameter.name][0], objection)
        for i, u in enumerate(h.unknowns.items)
        if u.parameter.name in effect_parameters and u.recording is None
        if (
            objection := _bound_objection(
                u.parameter, h.vector[i], effect_parameters[u.parameter.name][1]
            )
        )
        and reduction_beyond_bound(after, i) >= least * data.count
    ]


def _names_at_bounds(h: ParametrisedModel) -> set[str]:
    """Names of the shared parameters that stand at a bound."""
    pairs = zip(h.unknowns.items, h.vector, strict=True)
    return {u.parameter.name for u, x in pairs if u.recording is None and u.parameter.at_bound(x)}


def reduction_beyond_bound(after: Refit, i: int) -> float:
    """Predicted cost reduction if unknown `i` could pass its bound, with all unknowns inside theirs
    free."""
    limits, x = after.parametrised.limits, after.parametrised.vector
    others = np.flatnonzero(limits.inside(x) & (np.arange(len(x)) != i))
    A, b = with_prior(*normal_equations(after.descended.blocks, after.descended.slopes), x, limits)
    follow, across = pseudo_inverse(A[np.ix_(others, others)]), A[others, i]
    own = A[i, i] - across @ follow @ across
    push = b[i] - across @ follow @ b[others]
    outward = -push if limits.upper[i] - x[i] < x[i] - limits.lower[i] else push
    return float(push**2 / own) if outward > 0.0 and own > SEEN * A[i, i] else 0.0


def _bound_objection(p: Parameter, value: float, neutral: float) -> Objection | None:
    """An objection if the value is at a bound that is not next to neutral."""
    bound = p.lower if value - p.lower < p.upper - value else p.upper
    vanishes = abs(neutral - bound) <= AT_BOUND * p.scale
    if vanishes or not p.at_bound(value):
        return None
    return Objection(Reason.AT_BOUND, p.title or p.name, bound, p.unit)
