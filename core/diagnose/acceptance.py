"""Which effects a round adds to the model: a set of effects that leaves no more than noise, or the
best single effect that the judge accepts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..diagnose.effect_sets import best_effect_set
from ..diagnose.evidence import (
    LEAST_SHARE,
    WHOLE_SHARE,
    RefittedCandidate,
    assess_refit,
    certain,
    share_above_noise,
    small_share,
)
from ..diagnose.force_shape_refinement import refine_force_shape
from ..diagnose.judgement import Judge, at_bounds, indistinct
from ..diagnose.linear_screen import Screen, ScreenedCandidate
from ..effects.effect import Effect
from ..estimate.fit_result import FitResult, refit_with
from ..estimate.minimum import converge
from ..estimate.problem import FitData, within_noise
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


MOST_TRIED = 3
"""Effects of a ranking that are tried; after a rejection the next one follows."""


@dataclass(frozen=True)
class Acceptance:
    """What the checks of one round need."""

    data: FitData
    before: FitResult
    present: Sequence[Effect]
    seen: Screen
    candidate_count: int
    stopped: Callable[[], bool]
    judge: Judge
    refuted_in: dict[frozenset[str], set[str]] = field(default_factory=dict)
    """Kinds of a set that was refitted jointly -> those that were refuted. None is refitted twice.
    """

    def accept(self, refitted: Sequence[RefittedCandidate], most: int) -> Round:
        """The round with what is added of the `refitted` candidates, best first; `most` at most."""
        best = refitted[0].refit if refitted else self.before
        joint = None if self._explains(best) else self._accept_set(refitted, most)
        return joint or self._accept_single(refitted, most)

    def _accept_set(self, refitted: Sequence[RefittedCandidate], most: int) -> Round | None:
        """The round that adds the best set of effects that was not refuted, or None."""
        refuted_kinds: set[str] = set()
        while most > 1 and not self.stopped():
            members = best_effect_set(self.seen, most, self.data.count, refuted_kinds)
            kinds = frozenset(s.effect.kind for s in members)
            if len(kinds) < 2:
                return None
            accepted = None
            if kinds not in self.refuted_in:
                accepted, self.refuted_in[kinds] = self.try_jointly(members, refitted)
            refuted = self.refuted_in[kinds] & kinds
            if accepted is not None or not refuted:
                return accepted
            refuted_kinds |= refuted
        return None

    def _accept_single(self, refitted: Sequence[RefittedCandidate], most: int) -> Round:
        """The round that adds the best effect that the judge accepts."""
        still = Round(self.seen, tuple(refitted), None, self.before, self.before, self.data)
        refusals = list[Refusal]()
        for best in [w for w in refitted if certain(w)][:MOST_TRIED]:
            if self.stopped():
                break
            assessed, data, after = self._converge(best)
            objection = self._objection(assessed, data, after)
            if objection is None:
                others = [w for w in refitted if w.screened is not assessed.screened]
                return Round(
                    self.seen, (assessed, *others), assessed, self.before, after, data, (assessed,),
                    refusals,
                )  # fmt: skip
            refusals.append(Refusal(assessed, objection))
            if objection.reason is Reason.AT_BOUND and self._explains(after):
                # What is missing acts as it does: a weaker effect by itself would stand in too.
                joint = self._accept_set(refitted, most)
                return replace(joint or still, refusals=refusals)
        return replace(still, refusals=refusals)

    def _explains(self, after: FitResult) -> bool:
        """Whether a model explains nearly all of the error above the noise."""
        reduction = self.before.cost - after.cost
        return share_above_noise(reduction, self.before.cost, self.data.count) >= WHOLE_SHARE

    def _objection(self, w: RefittedCandidate, data: FitData, after: FitResult) -> Objection | None:
        """Why a converged effect is rejected; None if it is accepted. One that explains a small
        share stands only where unseen recordings confirm it: it may imitate what is not listed."""
        objection = self.judge.objection(data, after, [w.screened.effect], larger=True)
        if objection is not None or w.reduction >= LEAST_SHARE:
            return objection
        unseen = self.judge.unseen(data, after)
        confirmed = unseen is not None and unseen.surely_better
        return None if confirmed else small_share(w)

    def _converge(self, best: RefittedCandidate) -> tuple[RefittedCandidate, FitData, FitResult]:
        """The candidate, converged, with its best shape and the share of the error that a ladder
        step shows. Its evidence stays that of the round, in which all were refitted alike."""
        data, after = converge(self.data, best.refit.problem, self.seen.whitener, self.stopped)
        data, after = self._with_force_shapes(data, after, [best.screened.effect, *self.present])
        count = self.data.count
        step = assess_refit(best.screened, self.before, after, count, self.candidate_count)
        return replace(best, reduction=step.reduction, explained=step.explained), data, after

    def _with_force_shapes(
        self, data: FitData, after: FitResult, effects: Sequence[Effect]
    ) -> tuple[FitData, FitResult]:
        """Converged again with the best shape of each effect. A new effect can reveal the shape of
        an earlier one as long as an error is left. The new effect's shape is always refined: a
        wrong one may leave no more than noise, too."""
        new = {e.kind for e in effects} - {e.kind for e in self.present}
        for effect in effects:
            if effect.kind not in new and within_noise(data, after.errors):
                break
            reshaped = refine_force_shape(data, after, effect, self.stopped)
            if reshaped is not after:
                data, after = converge(data, reshaped.problem, self.seen.whitener, self.stopped)
        return data, after

    def _refit(
        self, members: Sequence[ScreenedCandidate], values: Mapping[str, float],
        scanned: Sequence[str],
    ) -> FitResult:  # fmt: skip
        effects = [*self.present, *[s.effect for s in members]]
        return refit_with(
            self.data, self.before.problem, effects, values, self.seen.whitener,
            self.seen.slopes, scanned, self.stopped,
        )  # fmt: skip

    def try_jointly(
        self, members: Sequence[ScreenedCandidate], refitted: Sequence[RefittedCandidate]
    ) -> tuple[Round | None, set[str]]:
        """(round that adds the set, or None; kinds of the set that were refuted)."""
        kinds = {s.effect.kind for s in members}
        sizes = {w.screened.effect.kind: w.refit.problem.values() for w in refitted}
        values: dict[str, float] = {}
        for s in members:
            own = dict(s.values)
            values |= own | {k: sizes.get(s.effect.kind, own).get(k, v) for k, v in own.items()}
        joint = self._refit(members, values, [name for s in members for name in s.scanned])
        if not np.isfinite(joint.cost) or self.stopped():
            return None, set()
        if not self._explains(joint):
            return None, {kind for kind, _ in at_bounds(joint, self.data, self.before)}
        data, after = converge(self.data, joint.problem, self.seen.whitener, self.stopped)
        data, after = self._with_force_shapes(data, after, [s.effect for s in members])
        refuted = {kind for kind, _ in at_bounds(after, data, self.before)}
        left = {e.kind for e in after.problem.model.effects}
        kept = [s for s in members if s.effect.kind in left]
        if len(kept) < 2 or indistinct(after, [s.effect for s in kept]):
            return None, refuted & kinds
        if self.judge.objection(data, after, [s.effect for s in kept], larger=True):
            return None, refuted & kinds or kinds
        singles = {w.screened.effect.kind: w for w in refitted}
        count = self.data.count
        added = tuple(
            singles.get(s.effect.kind)
            or assess_refit(s, self.before, after, count, self.candidate_count)
            for s in kept
        )
        order = (*added, *[w for w in refitted if w not in added])
        return Round(self.seen, order, added[0], self.before, after, data, added), set()
