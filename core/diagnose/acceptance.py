"""What one round puts into the model: a set of effects as a whole, or the best effect on its own.

What is accepted is polished first, then held against the bounds of its sizes, against the model
without it, and against recordings that no fit saw.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from ..diagnose.cost_minimum import converged
from ..diagnose.effect_sets import FoundSet, best_set
from ..diagnose.evidence import (
    RELEVANT,
    Weighed,
    acceptable,
    at_bounds,
    ended_at_bound,
    weigh,
)
from ..diagnose.fit_problem import Data, Hypothesis
from ..diagnose.linear_screen import Screen, Screened
from ..diagnose.refit import Refit, refit_with, robust_covariance
from ..diagnose.remaining_error import within_noise
from ..diagnose.shape_refinement import refine_shape
from ..effects.effect import Effect
from ..effects.sizes import typical
from ..results import Objection, Reason


@dataclass(frozen=True)
class Refusal:
    """An effect that explains enough and is not accepted."""

    weighed: Weighed
    objection: Objection

    @property
    def with_title(self) -> tuple[str, Objection]:
        """(title, why)"""
        return self.weighed.screened.effect.title, self.objection


@dataclass(frozen=True)
class Round:
    """What one round found."""

    screen: Screen
    weighed: tuple[Weighed, ...]
    """Best first."""
    accepted: Weighed | None
    before: Refit
    after: Refit
    data: Data
    """Anchored at `after`."""
    added: tuple[Weighed, ...] = ()
    """What leads from `before` to `after`, in the order of what each explains."""
    refusals: Sequence[Refusal] = ()
    """What was good enough by itself and was refused, best first."""
    unfitted: tuple[str, ...] = ()
    """Titles of effects of which no refit could be simulated."""

    @property
    def refused(self) -> tuple[tuple[str, Objection], ...]:
        """Why the best was not accepted; empty where it was, or explains too little."""
        return tuple(one.with_title for one in self.refusals[:1])


Gate = Callable[[Data, Refit], Objection | None]
"""Why a polished model is not accepted; None where it is."""


WHOLE = 0.9
"""Share of the error above the floor that a set must explain to be added as a whole; where one
effect alone explains as much, no set is tried. Effects hide each other, and the true ones show
themselves together only; but they leave nothing. A set that leaves an error is a way to bend what
is unknown, and the more parameters it has the further."""

PROMISING = 0.5
"""The same as expected from straight lines, below which no joint refit is tried, and to be a part
of the set is no merit; refits were seen to reach whole explanations from two thirds on."""


@dataclass(frozen=True)
class Acceptance:
    """What is needed to accept the outcome of a round."""

    data: Data
    before: Refit
    present: Sequence[Effect]
    seen: Screen
    tried: int
    stopped: Callable[[], bool]
    gate: Gate

    def sets(self, found: list[Weighed], most: int, tried: bool) -> tuple[Round | None, FoundSet]:
        """A round that adds a set of effects as a whole, or the best set that was not refuted;
        `tried`: whether one may be added."""
        without: set[str] = set()
        while True:
            together = best_set(self.seen, max(most, 1), self.data.count, without)
            promised = self._share(together.plain_drop)
            if not tried or len(together.members) < 2 or promised < PROMISING:
                return None, together
            joint, refuted = self.jointly(together, found)
            if joint is not None or not refuted:
                return joint, together
            without |= refuted  # to be a part of it is no merit any more

    def alone(self, found: list[Weighed], together: FoundSet, most: int) -> Round:
        """The best effect that may be accepted, on its own."""
        still = Round(self.seen, tuple(found), None, self.before, self.before, self.data)
        promising = self._share(together.plain_drop) >= PROMISING
        members = {s.effect.kind for s in together.members if promising}
        refusals = list[Refusal]()
        for best in found[:MOST_TRIED]:
            part = best.screened.effect.kind in members
            if not acceptable(best, part) or self.stopped():
                continue
            if not most:
                return replace(still, accepted=best)
            weighed, data, after = self._polished(best)
            refusal = self._refusal(weighed, data, after)
            if refusal is None:
                return replace(self._adding(weighed, data, after, found), refusals=refusals)
            refusals.append(refusal)
            at_bound = refusal.objection.reason is Reason.AT_BOUND
            if at_bound and best.reduction >= WHOLE:
                # What is missing acts as it does: a weaker effect by itself would stand in too.
                joint, _ = self.sets(found, most, tried=most > 1)
                return replace(joint or still, refusals=refusals)
        return replace(still, refusals=refusals)

    def _refusal(self, one: Weighed, data: Data, after: Refit) -> Refusal | None:
        """Why a polished effect is not accepted; None where it is."""
        found = (
            ended_at_bound(after, data)
            or self._unsettled(after)
            or indistinct([one.screened], after)
            or self.gate(data, after)
        )
        return Refusal(one, found) if found else None

    def _adding(self, one: Weighed, data: Data, after: Refit, found: list[Weighed]) -> Round:
        """The round that adds one effect."""
        order = (one, *[w for w in found if w.screened is not one.screened])
        return Round(self.seen, order, one, self.before, after, data, (one,))

    def _share(self, drop: float) -> float:
        """Of the squared error above the floor, by which the cost falls."""
        return drop / max(self.before.cost - self.data.count, 1.0)

    def _unsettled(self, after: Refit) -> Objection | None:
        """Where a model with more in it leaves more: it contains the one before."""
        return Objection(Reason.UNSETTLED) if after.cost > self.before.cost else None

    def _polished(self, best: Weighed) -> tuple[Weighed, Data, Refit]:
        """Converged, in its best shape. What it explains is that of the converged fit."""
        data, after = converged(self.data, best.refit.hypothesis, self.seen.whitener, self.stopped)
        data, after = self._shaped(data, after, [best.screened.effect, *self.present])
        return self._with_share(best, self.before, after), data, after

    def _with_share(self, one: Weighed, before: Refit, after: Refit) -> Weighed:
        """With the share of the error that a step of the ladder shows. Its evidence stays that of
        the round, in which all candidates were refitted alike."""
        step = weigh(one.screened, before, after, self.data.count, self.tried)
        return replace(one, reduction=step.reduction, explained=step.explained)

    def _shaped(self, data: Data, after: Refit, effects: Sequence[Effect]) -> tuple[Data, Refit]:
        """Converged anew with each of the effects in its best shape: what came later uncovers the
        shape of what was there before, as long as an error is left. The shape of what is new is
        looked at in any case: a wrong one may leave no more than noise too, on these recordings."""
        new = {e.kind for e in effects} - {e.kind for e in self.present}
        for one in effects:
            if one.kind not in new and within_noise(data, after.errors):
                break
            other = refine_shape(data, after, one, self.stopped)
            if other is not after:
                data, after = converged(data, other.hypothesis, self.seen.whitener, self.stopped)
        return data, after

    def _refit(
        self, members: Sequence[Screened], values: Mapping[str, float], scanned: Sequence[str]
    ) -> Refit:
        effects = [*self.present, *[s.effect for s in members]]
        return refit_with(
            self.data, self.before.hypothesis, effects, values, self.seen.whitener,
            self.seen.slopes, scanned, self.stopped,
        )  # fmt: skip

    def jointly(self, together: FoundSet, found: list[Weighed]) -> tuple[Round | None, set[str]]:
        """The set, where together it explains everything and passes the gate; and the members that
        were refuted, by a size at its bound, or all of them by the gate."""
        members = together.members
        refitted = {w.screened.effect.kind: w.refit.hypothesis.values() for w in found}
        values: dict[str, float] = {}
        for s in members:
            own = dict(s.values)
            values |= own | {k: refitted.get(s.effect.kind, own).get(k, v) for k, v in own.items()}
        whole = self._refit(members, values, [name for s in members for name in s.scanned])
        if not np.isfinite(whole.cost) or self.stopped():
            return None, set()
        best = min((w.refit.cost for w in found), default=self.before.cost)
        share = self._share(self.before.cost - whole.cost)
        if best - whole.cost < RELEVANT * self.data.count or share < WHOLE:
            return None, {kind for kind, _ in at_bounds(whole, self.data)}
        data, after = converged(self.data, whole.hypothesis, self.seen.whitener, self.stopped)
        data, after = self._shaped(data, after, [s.effect for s in members])
        there = {e.kind for e in after.hypothesis.model.effects}
        members = tuple(s for s in members if s.effect.kind in there)
        ended = {kind for kind, _ in at_bounds(after, data)}
        if ended or self._unsettled(after) or self.gate(data, after):
            return None, ended or {s.effect.kind for s in members}
        if len(members) < 2 or indistinct(members, after):
            return None, set()
        alone = {w.screened.effect.kind: w for w in found}
        added = tuple(
            alone.get(s.effect.kind) or weigh(s, self.before, after, self.data.count, self.tried)
            for s in members
        )
        order = (*added, *[w for w in found if w not in added])
        return Round(self.seen, order, added[0], self.before, after, data, added), set()


MOST_TRIED = 3
"""Of a ranking: what is refused gives way to the next, but a fourth would be a guess."""


DISTINCT = 0.05
"""Probability that the stated deviations give to sizes as far from neutral by noise alone, above
which an effect is not named: a reader would see 0.24 +- 0.24. Evidence counts samples as a whitener
leaves them, and where the encoders' noise shakes the arm that was 170 in favour of such a size."""


def indistinct(members: Sequence[Screened], after: Refit) -> Objection | None:
    """Where a fit cannot distinguish the sizes of one of the effects from neutral; None where it
    distinguishes all. A size at its bound has no deviation, and counts as distinct."""
    covariance, h = robust_covariance(after), after.hypothesis
    labels = list(h.unknowns.labels)
    for s in members:
        which = [labels.index(name) for name in s.parameters if name in labels]
        C = covariance[np.ix_(which, which)]
        if not which or not np.isfinite(C).all():
            continue
        apart = h.vector[which] - np.array([_neutral(h, s.effect, labels[j]) for j in which])
        wald = float(apart @ np.linalg.pinv(C, hermitian=True) @ apart)
        if scipy.stats.chi2.sf(wald, len(which)) > DISTINCT:
            return Objection(Reason.INDISTINCT)
    return None


def _neutral(h: Hypothesis, one: Effect, name: str) -> float:
    model = h.model
    own = one.parameters(model.arm, model.drive, typical(model.arm))
    return next((k.neutral for k in own if k.parameter.name == name), 0.0)
