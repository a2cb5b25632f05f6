"""From falls of the error to evidence: how much was explained, how sure, how it is ranked.

A size that ends at the bound of what is plausible speaks against its effect: what needs a larger
one is something else.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from ..diagnose.fit_problem import Data
from ..diagnose.linear_screen import Screened
from ..diagnose.refit import Refit
from ..effects.sizes import typical
from ..least_squares import GOOD_ENOUGH, SEEN, normal_equations, pseudo_inverse
from ..parameters import Parameter
from ..results import ABOVE, Objection, Reason

SURE = 0.01
"""Family-wise error of the significance test, over all candidates of a round."""

BAR = 0.3
"""Share of the error above the floor that must be explained for an effect to be accepted: by it,
or, where a set of effects explains most of it, by that set. Four equal effects explain a quarter
each."""

RELEVANT = 0.04
"""Least explained squared error per sample, in floors squared: 0.2 of the floor's rms. With
thousands of samples far less is significant, but it is not worth a word."""

PRICE = 0.05
"""In log(1 - reduction) per parameter: of two effects that explain the same the simpler one is
preferred."""


CLOSE = 0.3
"""In merit: refits that leave nearly the same error are ranked by their whitened evidence."""

AT_BOUND = 0.05
"""Of a plausible size: this close to the bound next to neutral nothing is left of an effect."""

TIE = 10.0
"""Difference of BIC below which two refits tie; above, the evidence is called very strong."""

ALL = 0.02
"""Share of the error above the noise floor below which nothing is left to explain."""


@dataclass(frozen=True)
class Weighed:
    """One refitted candidate against the base."""

    screened: Screened
    refit: Refit
    parameters: int
    """Of the effect, with those that shape it."""
    reduction: float
    """Share of the squared error above the floor that it explains, at most 1."""
    explained: float
    """Squared error explained per sample, in floors squared."""
    white_drop: float
    """Reduction of the whitened squared error."""
    delta_bic: float
    """White drop minus the price of the parameters; above 10 is very strong."""
    p_value: float

    @property
    def merit(self) -> float:
        """log(1 - reduction) with a price per parameter; the least is best."""
        return _merit(self.reduction, self.parameters)


def _merit(reduction: float, parameters: int) -> float:
    return float(np.log(max(1.0 - reduction, ALL))) + PRICE * parameters


def _above(base: float, drop: float, count: int) -> float:
    """The squared error of which a drop is a share."""
    return max(base - count, drop, RELEVANT * count)


def merit(base: float, cost: float, count: int, parameters: int) -> float:
    """Of a refit that has come from the squared error `base` to `cost` over `count` samples."""
    drop = base - cost
    if not np.isfinite(drop):
        return np.inf
    return _merit(max(drop, 0.0) / _above(base, drop, count), parameters)


def weigh(screened: Screened, base: Refit, refit: Refit, count: int, tried: int) -> Weighed:
    """`count` samples; `tried` candidates in the round (Bonferroni, an upper bound of Holm)."""
    own = len(refit.hypothesis.unknowns) - len(base.hypothesis.unknowns)
    own = max(own, screened.freedom)
    drop = base.cost - refit.cost
    above = _above(base.cost, drop, count)
    white = max(base.white_cost - refit.white_cost, 0.0)
    p = float(scipy.stats.chi2.sf(white, own)) * tried * screened.tried
    return Weighed(
        screened=screened,
        refit=refit,
        parameters=own,
        reduction=max(drop, 0.0) / above,
        explained=drop / count,
        white_drop=white,
        delta_bic=white - own * float(np.log(count)),
        p_value=min(p, 1.0),
    )


def acceptable(w: Weighed, part: bool = False) -> bool:
    """Significant, relevant, and a real share of what there is above the floor, by itself or as
    `part` of a set of effects that explains one together."""
    sure = w.p_value < SURE and w.delta_bic > TIE
    return sure and w.explained >= RELEVANT and (part or w.reduction >= BAR)


def ranked(found: list[Weighed]) -> list[Weighed]:
    """Best first: by merit; among those that come close by the sharper whitened evidence; among
    those that tie in it the simplest; and a part of the best before it, where that does as well."""
    best = min((w.merit for w in found), default=0.0)
    close = [w for w in found if w.merit <= best + CLOSE]
    rest = [w for w in found if w.merit > best + CLOSE]
    most = max((w.delta_bic for w in close), default=0.0)
    level = [w for w in close if w.delta_bic > most - TIE]
    below = [w for w in close if w.delta_bic <= most - TIE]
    return _part_first(
        sorted(level, key=lambda w: (w.parameters, -w.delta_bic))
        + sorted(below, key=lambda w: -w.delta_bic)
        + sorted(rest, key=lambda w: w.merit)
    )


def _part_first(found: list[Weighed]) -> list[Weighed]:
    """While a second effect is missing, the sizes that an effect has beside a simpler one that it
    includes take up some of it, and the evidence is for them. By merit the simpler one is no worse
    then; what else there is to it has its turn in the next round."""
    parts = [
        w
        for w in found[1:]
        if w.screened.effect.kind in found[0].screened.effect.includes
        and w.merit <= found[0].merit
        and acceptable(w)
    ]
    kinds = {w.screened.effect.kind for w in parts}
    return parts + [w for w in found if w.screened.effect.kind not in kinds]


def ended_at_bound(after: Refit, data: Data) -> Objection | None:
    """The first size that ended at the bound far from neutral and is pressed against it."""
    return next((objection for _, objection in at_bounds(after, data)), None)


def at_bounds(after: Refit, data: Data) -> list[tuple[str, Objection]]:
    """(effect, objection) of each size at the bound far from neutral, where the recordings want it
    beyond: by any reduction that a descent goes on for, and where the error is down to the floor by
    a relevant one. What nothing presses, such as how soon a friction of no size slips, says
    nothing.
    """
    h = after.hypothesis
    enough = GOOD_ENOUGH if after.cost > ABOVE**2 * data.count else RELEVANT
    effect_parameters = {
        k.parameter.name: (one.kind, k.neutral)
        for one in h.model.effects
        for k in one.parameters(h.model.arm, h.model.drive, typical(h.model.arm))
        if not k.secondary
    }
    return [
        (effect_parameters[u.parameter.name][0], objection)
        for i, u in enumerate(h.unknowns.items)
        if u.parameter.name in effect_parameters and u.recording is None
        if (objection := _ends(u.parameter, h.vector[i], effect_parameters[u.parameter.name][1]))
        and beyond(after, i) >= enough * data.count
    ]


def beyond(after: Refit, i: int) -> float:
    """By how much the cost would fall, as straight lines have it, if unknown i could pass the bound
    that it stands at and all others that are inside theirs followed."""
    limits, x = after.hypothesis.limits, after.hypothesis.vector
    others = np.flatnonzero(limits.inside(x) & (np.arange(len(x)) != i))
    A, b = normal_equations(after.descended.blocks, after.descended.slopes)
    follow, across = pseudo_inverse(A[np.ix_(others, others)]), A[others, i]
    own = A[i, i] - across @ follow @ across
    push = b[i] - across @ follow @ b[others]
    outward = -push if limits.upper[i] - x[i] < x[i] - limits.lower[i] else push
    return float(push**2 / own) if outward > 0.0 and own > SEEN * A[i, i] else 0.0


def _ends(p: Parameter, value: float, neutral: float) -> Objection | None:
    """Where the value stands at a bound, and not at the one next to neutral."""
    bound = p.lower if value - p.lower < p.upper - value else p.upper
    vanishes = abs(neutral - bound) <= AT_BOUND * p.scale
    if vanishes or not p.at_bound(value):
        return None
    return Objection(Reason.AT_BOUND, p.title or p.name, bound, p.unit)
