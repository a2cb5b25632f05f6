"""What a model must pass to take the place of another one, however it came about: no size at the
bound of what is plausible, none within its deviation of no effect, no more error than before, and
recordings that no fit has seen become no worse."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from ..diagnose.evidence import RefittedCandidate
from ..effects.effect import Effect, EffectParameter
from ..effects.sizes import typical
from ..estimate.fit_result import FitResult, identified_unknowns, robust_covariance
from ..estimate.fitted_model import FittedModel
from ..estimate.minimum import RELEVANT
from ..estimate.problem import FitData, Problem, within_noise
from ..estimate.validation import UnseenChange, ValidationFit
from ..least_squares import GOOD_ENOUGH, SEEN, normal_equations, pseudo_inverse, with_prior
from ..parameters import Parameter
from ..results import ABOVE, Objection, Reason

AT_BOUND = 0.05
"""Of a plausible size: this close to the bound next to neutral an effect has vanished."""

DISTINCT = 0.05
"""An effect is not named if noise alone gives sizes this far from neutral with a higher
probability: a reader would see 0.24 +- 0.24. Whitened evidence alone does not suffice: encoder
noise that excites the arm gave 170 in favour of such a size."""


@dataclass(frozen=True)
class Judge:
    """What is asked of a model that is to take the place of this one."""

    model: FittedModel
    validation_fit: Callable[[FittedModel], ValidationFit | None] = lambda _: None

    def objection(
        self, data: FitData, after: FitResult, new: Sequence[Effect], larger: bool = False
    ) -> Objection | None:
        """What speaks against a converged model with `new` effects, or None. `larger`: it contains
        the one before."""
        before = self.model.refit
        if larger and after.cost > before.cost:
            return Objection(Reason.UNSETTLED)
        bounds = at_bounds(after, data, before)
        return (
            next((objection for _, objection in bounds), None)
            or indistinct(after, new)
            or self._within_laws(data, after)
            or self._worse_unseen(data, after)
        )

    def unseen(self, data: FitData, after: FitResult) -> UnseenChange | None:
        """The change on recordings that no fit has seen; None without any."""
        later = self.validation_fit(FittedModel(data, after, ()))
        if self._unseen is None or later is None:
            return None
        return UnseenChange.between(self._unseen, later)

    def fit_to_unseen(self, w: RefittedCandidate) -> ValidationFit | None:
        """A refit on recordings that no fit has seen; None without any."""
        return self.validation_fit(FittedModel(self.model.data, w.refit, ()))

    @cached_property
    def _unseen(self) -> ValidationFit | None:
        return self.validation_fit(self.model)

    def _within_laws(self, data: FitData, after: FitResult) -> Objection | None:
        """What the idealised laws of the model may miss counts as noise, unless the new one leaves
        nothing above the noise."""
        missed = self.model.within_laws and not within_noise(data, after.errors)
        return Objection(Reason.WITHIN_LAWS) if missed else None

    def _worse_unseen(self, data: FitData, after: FitResult) -> Objection | None:
        unseen = self.unseen(data, after)
        if unseen is None or not unseen.refutes:
            return None
        return Objection(Reason.UNSEEN, unseen=unseen.rms)


def sizes_of_effect(problem: Problem, effect: Effect) -> tuple[EffectParameter, ...]:
    """The parameters of an effect with those that shape it."""
    return effect.parameters(problem.model.arm, problem.model.drive, typical(problem.model.arm))


def indistinct(after: FitResult, effects: Sequence[Effect]) -> Objection | None:
    """An objection if a fit cannot distinguish the sizes of one effect from neutral, else None:
    those that the recordings determine. A size at its bound has no standard deviation and counts as
    distinct."""
    covariance, problem = robust_covariance(after), after.problem
    labels, identified = list(problem.unknowns.labels), identified_unknowns(after)
    for effect in effects:
        neutral = {
            k.parameter.name: k.neutral for k in sizes_of_effect(problem, effect) if not k.secondary
        }
        own = [labels.index(name) for name in neutral if name in labels]
        if not own or not np.isfinite(covariance[np.ix_(own, own)]).all():
            continue
        which = [k for k in own if identified[k]]
        if not which:
            return Objection(Reason.INDISTINCT)
        C = covariance[np.ix_(which, which)]
        distance = problem.vector[which] - np.array([neutral[labels[j]] for j in which])
        wald = float(distance @ np.linalg.pinv(C, hermitian=True) @ distance)
        if scipy.stats.chi2.sf(wald, len(which)) > DISTINCT:
            return Objection(Reason.INDISTINCT)
    return None


def at_bounds(after: FitResult, data: FitData, before: FitResult) -> list[tuple[str, Objection]]:
    """(effect, objection) of each size that the recordings press against its bound far from
    neutral, unless a person stated the bound or the model `before` stood at it already: that says
    nothing of what was added.

    The predicted reduction beyond the bound must be one that a descent continues for; near the
    noise floor, a relevant one.
    """
    problem = after.problem
    not_new = data.bounded | _names_at_bounds(before.problem)
    least = GOOD_ENOUGH if after.cost > ABOVE**2 * data.count else RELEVANT
    own = {
        k.parameter.name: (effect.kind, k.neutral)
        for effect in problem.model.effects
        for k in sizes_of_effect(problem, effect)
        if not k.secondary and k.parameter.name not in not_new
    }
    pressed = []
    for i, u in enumerate(problem.unknowns.items):
        if u.parameter.name not in own or u.recording is not None:
            continue
        kind, neutral = own[u.parameter.name]
        objection = _bound_objection(u.parameter, problem.vector[i], neutral)
        if objection and reduction_beyond_bound(after, i) >= least * data.count:
            pressed.append((kind, objection))
    return pressed


def _names_at_bounds(problem: Problem) -> set[str]:
    """Names of the shared parameters that stand at a bound."""
    pairs = zip(problem.unknowns.items, problem.vector, strict=True)
    return {u.parameter.name for u, x in pairs if u.recording is None and u.parameter.at_bound(x)}


def reduction_beyond_bound(after: FitResult, i: int) -> float:
    """Predicted cost reduction if unknown `i` could pass its bound, with all unknowns inside theirs
    free."""
    limits, x = after.problem.limits, after.problem.vector
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
