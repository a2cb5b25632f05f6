"""Which effects a round adds to the model: one set of effects, or the best single effect.

A candidate is refitted until it converges. Then four checks follow: parameter bounds, cost,
distance from neutral, and validation recordings.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy

from ..diagnose.cost_minimum import converge
from ..diagnose.effect_sets import EffectSet, best_effect_set
from ..diagnose.evidence import (
    RELEVANT,
    WORSE,
    RefittedCandidate,
    acceptable,
    assess_refit,
    at_bounds,
    certain,
    ended_at_bound,
    share_above_noise,
    small_share,
)
from ..diagnose.fit_problem import FitProblem, ParametrisedModel
from ..diagnose.force_shape_refinement import refine_force_shape
from ..diagnose.linear_screen import Screen, ScreenedCandidate
from ..diagnose.refit import Refit, refit_with, robust_covariance
from ..diagnose.remaining_error import within_noise
from ..effects.effect import Effect
from ..effects.sizes import typical
from ..noise.noise_floor import squares_by_channel
from ..results import Objection, Reason


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
    before: Refit
    after: Refit
    data: FitProblem
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


ModelCheck = Callable[[FitProblem, Refit], Objection | None]
"""Why a converged model is rejected; None if it is accepted."""


WHOLE_SHARE = 0.9
"""Share of the error above the noise floor that a set must explain to be added as a whole. No set
is tried if one effect alone explains as much. Effects can hide each other; the true ones together
leave no error. A set that leaves an error only bends what is unknown."""

PROMISING_SHARE = 0.5
"""The same share as predicted by the linear screen. Below it no joint refit is tried, and
membership in the set does not count. Refits reached whole explanations from two thirds on."""


@dataclass(frozen=True)
class Acceptance:
    """What the checks of one round need."""

    data: FitProblem
    before: Refit
    present: Sequence[Effect]
    seen: Screen
    candidate_count: int
    stopped: Callable[[], bool]
    check: ModelCheck
    least_share: float = 0.0
    """Of the error above noise, that a refit must explain to be converged."""
    refuted_in: dict[frozenset[str], set[str]] = field(default_factory=dict)
    """Kinds of a set that was refitted jointly -> those that were refuted. None is refitted twice.
    """

    def try_sets(
        self, refitted: list[RefittedCandidate], most: int, allowed: bool
    ) -> tuple[Round | None, EffectSet]:
        """(round that adds a set of effects, or None; the best set that was not refuted).
        `allowed`: whether a set may be added."""
        refuted_kinds: set[str] = set()
        while True:
            together = best_effect_set(self.seen, max(most, 1), self.data.count, refuted_kinds)
            predicted_share = self._share(together.unwhitened_reduction)
            kinds = frozenset(s.effect.kind for s in together.members)
            worthwhile = len(kinds) > 1 and predicted_share >= PROMISING_SHARE
            if not allowed or not worthwhile:
                return None, together
            accepted = None
            if kinds not in self.refuted_in:
                accepted, self.refuted_in[kinds] = self.try_jointly(together, refitted)
            refuted = self.refuted_in[kinds] & kinds
            if accepted is not None or not refuted:
                return accepted, together
            refuted_kinds |= refuted  # a candidate of this set has no advantage any more

    def try_single(
        self, refitted: list[RefittedCandidate], together: EffectSet, most: int
    ) -> Round:
        """The round that adds the best acceptable single effect."""
        still = Round(self.seen, tuple(refitted), None, self.before, self.before, self.data)
        promising = self._share(together.unwhitened_reduction) >= PROMISING_SHARE
        members = {s.effect.kind for s in together.members if promising}
        refusals = list[Refusal]()
        for best in refitted[:MOST_TRIED]:
            part = best.screened.effect.kind in members
            if not acceptable(best, part):
                if certain(best):
                    refusals.append(Refusal(best, small_share(best)))
                continue
            if best.reduction < self.least_share:
                refusals.append(Refusal(best, Objection(Reason.WITHIN_LAWS)))
                continue
            if self.stopped():
                break
            assessed, data, after = self._converge(best)
            refusal = self._refusal(assessed, data, after)
            if refusal is None:
                others = [w for w in refitted if w.screened is not assessed.screened]
                return Round(
                    self.seen, (assessed, *others), assessed, self.before, after, data, (assessed,),
                    refusals,
                )  # fmt: skip
            refusals.append(refusal)
            at_bound = refusal.objection.reason is Reason.AT_BOUND
            if at_bound and best.reduction >= WHOLE_SHARE:
                # What is missing acts as it does: a weaker effect by itself would stand in too.
                joint, _ = self.try_sets(refitted, most, allowed=most > 1)
                return replace(joint or still, refusals=refusals)
        return replace(still, refusals=refusals)

    def _refusal(
        self, candidate: RefittedCandidate, data: FitProblem, after: Refit
    ) -> Refusal | None:
        """Why a converged effect is rejected; None if it is accepted."""
        objection = (
            ended_at_bound(after, data, self.before)
            or self._cost_objection(after)
            or near_neutral_objection([candidate.screened], after)
            or self.check(data, after)
        )
        return Refusal(candidate, objection) if objection else None

    def _share(self, reduction: float) -> float:
        """`cost_reduction` as a share of the squared error above the noise floor."""
        return share_above_noise(reduction, self.before.cost, self.data.count)

    def _cost_objection(self, after: Refit) -> Objection | None:
        """An objection if the larger model has a higher cost: it contains the smaller one."""
        return Objection(Reason.UNSETTLED) if after.cost > self.before.cost else None

    def _converge(self, best: RefittedCandidate) -> tuple[RefittedCandidate, FitProblem, Refit]:
        """The candidate, converged, with its best shape and the share of the error that a ladder
        step shows. Its evidence stays that of the round, in which all were refitted alike."""
        data, after = converge(self.data, best.refit.parametrised, self.seen.whitener, self.stopped)
        data, after = self._with_force_shapes(data, after, [best.screened.effect, *self.present])
        count = self.data.count
        step = assess_refit(best.screened, self.before, after, count, self.candidate_count)
        return replace(best, reduction=step.reduction, explained=step.explained), data, after

    def _with_force_shapes(
        self, data: FitProblem, after: Refit, effects: Sequence[Effect]
    ) -> tuple[FitProblem, Refit]:
        """Converged again with the best shape of each effect. A new effect can reveal the shape of
        an earlier one as long as an error is left. The new effect's shape is always refined: a
        wrong one may leave no more than noise, too."""
        new = {e.kind for e in effects} - {e.kind for e in self.present}
        for effect in effects:
            if effect.kind not in new and within_noise(data, after.errors):
                break
            reshaped = refine_force_shape(data, after, effect, self.stopped)
            if reshaped is not after:
                data, after = converge(
                    data, reshaped.parametrised, self.seen.whitener, self.stopped
                )
        return data, after

    def _refit(
        self, members: Sequence[ScreenedCandidate], values: Mapping[str, float],
        scanned: Sequence[str],
    ) -> Refit:  # fmt: skip
        effects = [*self.present, *[s.effect for s in members]]
        return refit_with(
            self.data, self.before.parametrised, effects, values, self.seen.whitener,
            self.seen.slopes, scanned, self.stopped,
        )  # fmt: skip

    def try_jointly(
        self, together: EffectSet, refitted: list[RefittedCandidate]
    ) -> tuple[Round | None, set[str]]:
        """(round that adds the set, or None; kinds of the set that were refuted). A size at its
        bound refutes its effect; that of an effect of the model, and the gate, refute all of
        them."""
        members = together.members
        kinds = {s.effect.kind for s in members}
        sizes = {w.screened.effect.kind: w.refit.parametrised.values() for w in refitted}
        values: dict[str, float] = {}
        for s in members:
            own = dict(s.values)
            values |= own | {k: sizes.get(s.effect.kind, own).get(k, v) for k, v in own.items()}
        joint = self._refit(members, values, [name for s in members for name in s.scanned])
        if not np.isfinite(joint.cost) or self.stopped():
            return None, set()
        best = min((w.refit.cost for w in refitted), default=self.before.cost)
        share = self._share(self.before.cost - joint.cost)
        if best - joint.cost < RELEVANT * self.data.count or share < WHOLE_SHARE:
            return None, {kind for kind, _ in at_bounds(joint, self.data, self.before)}
        data, after = converge(self.data, joint.parametrised, self.seen.whitener, self.stopped)
        data, after = self._with_force_shapes(data, after, [s.effect for s in members])
        left = {e.kind for e in after.parametrised.model.effects}
        members = tuple(s for s in members if s.effect.kind in left)
        refuted = {kind for kind, _ in at_bounds(after, data, self.before)}
        if refuted or self._cost_objection(after) or self.check(data, after):
            return None, refuted & kinds or kinds
        if len(members) < 2 or near_neutral_objection(members, after):
            return None, set()
        singles = {w.screened.effect.kind: w for w in refitted}
        added = tuple(
            singles.get(s.effect.kind)
            or assess_refit(s, self.before, after, self.data.count, self.candidate_count)
            for s in members
        )
        order = (*added, *[w for w in refitted if w not in added])
        return Round(self.seen, order, added[0], self.before, after, data, added), set()


MOST_TRIED = 3
"""Effects of a ranking that are tried; after a rejection the next one follows."""


DISTINCT = 0.05
"""An effect is not named if noise alone gives sizes this far from neutral with a higher
probability: a reader would see 0.24 +- 0.24. Whitened evidence alone does not suffice: encoder
noise that excites the arm gave 170 in favour of such a size."""


def near_neutral_objection(members: Sequence[ScreenedCandidate], after: Refit) -> Objection | None:
    """An objection if a fit cannot distinguish the sizes of one effect from neutral, else None. A
    size at its bound has no standard deviation and counts as distinct."""
    covariance, h = robust_covariance(after), after.parametrised
    labels = list(h.unknowns.labels)
    for s in members:
        which = [labels.index(name) for name in s.parameters if name in labels]
        C = covariance[np.ix_(which, which)]
        if not which or not np.isfinite(C).all():
            continue
        neutral = _neutral_values(h, s.effect)
        distance = h.vector[which] - np.array([neutral.get(labels[j], 0.0) for j in which])
        wald = float(distance @ np.linalg.pinv(C, hermitian=True) @ distance)
        if scipy.stats.chi2.sf(wald, len(which)) > DISTINCT:
            return Objection(Reason.INDISTINCT)
    return None


def _neutral_values(h: ParametrisedModel, effect: Effect) -> dict[str, float]:
    own = effect.parameters(h.model.arm, h.model.drive, typical(h.model.arm))
    return {k.parameter.name: k.neutral for k in own}


def model_check(
    data: FitProblem, before: Refit, within_laws: bool,
    unseen: Callable[[FitProblem, Refit], float | None],
) -> ModelCheck:  # fmt: skip
    """Rejects a model that increases the validation error by more than noise could. Where the error
    `before` is within what that model's laws may miss, it counts as noise unless the new one
    explains nearly all of it, however well the noise is known."""

    def refuse(later: FitProblem, refit: Refit) -> Objection | None:
        left, above = (_above_noise(later, r.errors) for r in (refit, before))
        if within_laws and not np.all(left < (1.0 - WHOLE_SHARE) * above):
            return Objection(Reason.WITHIN_LAWS)
        old, new = unseen(data, before), unseen(later, refit)
        if old is None or new is None:
            return None
        if new - old < RELEVANT or new < WORSE**2 * old:
            return None
        return Objection(Reason.UNSEEN, unseen=(math.sqrt(old), math.sqrt(new)))

    return refuse


def _above_noise(data: FitProblem, errors: Sequence[np.ndarray]) -> np.ndarray:
    """(2,): squared error above the noise in each channel, for the noise as it is estimated and as
    large as it may be."""
    squares, total = squares_by_channel(data.experiments, errors), np.zeros(2)
    for name, x in squares.items():
        within = np.array([1.0, data.floor_uncertainty.get(name, 1.0)])
        total += np.maximum(np.sum(x) / within**2 - len(x), 0.0)
    return total
