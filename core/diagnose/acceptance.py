"""Which effects a round adds to the model: a set that explains nearly all that is above the noise,
or the best single effect that the judge accepts.

The whitened Gram matrix shows what any set explains, so sets need no simulation. Forward selection
with exchange: an imitation that came first is replaced by the true pair. The chosen set is then
refitted.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..diagnose.evidence import (
    LEAST_SHARE,
    WHOLE_SHARE,
    RefittedCandidate,
    Refusal,
    Round,
    assess_refit,
    certain,
    price,
    share_above_noise,
    small_share,
)
from ..diagnose.force_shape_refinement import refine_force_shape
from ..diagnose.gram_matrix import explained_by
from ..diagnose.judgement import Judge, at_bounds, indistinct
from ..diagnose.linear_screen import Screen, ScreenedCandidate
from ..effects.effect import Effect
from ..estimate.fit_result import FitResult, refit_with
from ..estimate.minimum import RELEVANT, converge
from ..estimate.problem import FitData, within_noise, within_tolerance
from ..results import Objection, Reason

MOST_TRIED = 3
"""Effects of a ranking that are tried; after a rejection the next one follows."""


@dataclass(frozen=True)
class Acceptance:
    """What the checks of one round need."""

    data: FitData
    before: FitResult
    present: Sequence[Effect]
    screened: Screen
    candidate_count: int
    stopped: Callable[[], bool]
    judge: Judge
    refuted_in: dict[frozenset[str], set[str]] = field(default_factory=dict)
    """Kinds of a set that was refitted jointly -> those that were refuted. None is refitted twice.
    """

    @cached_property
    def tolerated(self) -> bool:
        """Whether the model before is within what a person allows it to miss beside the noise."""
        return within_tolerance(self.data, self.before.errors)

    def accept(self, refitted: Sequence[RefittedCandidate], most: int) -> Round:
        """The round with what is added of the `refitted` candidates, best first; `most` at most."""
        best = refitted[0].refit if refitted else self.before
        alone = self._explains(best) or self.tolerated
        joint = None if alone else self._accept_set(refitted, most)
        return joint or self._accept_single(refitted, most)

    def _accept_set(self, refitted: Sequence[RefittedCandidate], most: int) -> Round | None:
        """The round that adds the best set of effects that was not refuted, or None."""
        refuted_kinds: set[str] = set()
        while most > 1 and not self.stopped():
            members = best_effect_set(self.screened, most, self.data.count, refuted_kinds)
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
        still = Round(self.screened, tuple(refitted), None, self.before, self.before, self.data)
        refusals = list[Refusal]()
        for best in [w for w in refitted if certain(w)][:MOST_TRIED]:
            if self.stopped():
                break
            assessed, data, after = self._converge(best)
            objection = self._objection(assessed, data, after)
            if objection is None:
                others = [w for w in refitted if w.screened is not assessed.screened]
                return Round(
                    self.screened, (assessed, *others), assessed, self.before, after, data,
                    (assessed,), refusals,
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
        share may imitate what is not listed: it stands only where unseen recordings confirm it, and
        it explains more than the noise itself. Of what a person allows the model to miss it
        explains nearly all, and unseen recordings confirm it where there are any."""
        objection = self.judge.objection(data, after, [w.screened.effect], larger=True)
        tolerated = self.tolerated
        enough = w.reduction >= (WHOLE_SHARE if tolerated else LEAST_SHARE)
        if objection is not None or (enough and not tolerated):
            return objection
        if tolerated and not enough:
            return small_share(w)
        unseen = self.judge.unseen(data, after)
        if unseen is not None and unseen.surely_better:
            return None if tolerated or w.explained > 1.0 else small_share(w)
        if tolerated:
            return None if unseen is None else Objection(Reason.UNSEEN, unseen=unseen.rms)
        return small_share(w)

    def _converge(self, best: RefittedCandidate) -> tuple[RefittedCandidate, FitData, FitResult]:
        """The candidate, converged, with its best shape and the share of the error that a ladder
        step shows. Its evidence stays that of the round, in which all were refitted alike."""
        data, after = converge(self.data, best.refit.problem, self.screened.whitener, self.stopped)
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
                data, after = converge(data, reshaped.problem, self.screened.whitener, self.stopped)
        return data, after

    def _refit(
        self, members: Sequence[ScreenedCandidate], values: Mapping[str, float],
        scanned: Sequence[str],
    ) -> FitResult:  # fmt: skip
        effects = [*self.present, *[s.effect for s in members]]
        return refit_with(
            self.data, self.before.problem, effects, values, self.screened.whitener,
            self.screened.slopes, scanned, self.stopped,
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
        data, after = converge(self.data, joint.problem, self.screened.whitener, self.stopped)
        data, after = self._with_force_shapes(data, after, [s.effect for s in members])
        refuted = {kind for kind, _ in at_bounds(after, data, self.before)}
        left = {e.kind for e in after.problem.model.effects}
        kept = [s for s in members if s.effect.kind in left]
        explained = (self.before.cost - after.cost) / self.data.count
        small = explained < len(kept) * RELEVANT  # each must explain a relevant amount
        if len(kept) < 2 or small or indistinct(after, [s.effect for s in kept]):
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
        return Round(self.screened, order, added[0], self.before, after, data, added), set()


MOST_TOGETHER = 4
"""Effects of one set: linear predictions of more say little."""


def best_effect_set(
    screened: Screen, most: int, count: int, excluded: Collection[str] = ()
) -> tuple[ScreenedCandidate, ...]:
    """The set of at most `most` effects with the best extended BIC over `count` samples, without
    the kinds `excluded`, by linear prediction; each adds most to those before it."""
    search = _Search(screened, count, excluded)
    chosen: list[ScreenedCandidate] = []
    while len(chosen) < min(most, MOST_TOGETHER):
        best = search.best_addition(chosen)
        if best is None:
            break
        chosen = search.exchanged([*chosen, best])
    return tuple(search.ordered(chosen))


class _Search:
    def __init__(self, screened: Screen, count: int, excluded: Collection[str]) -> None:
        self._whitened = screened.whitened.projected()
        self._unwhitened = screened.unwhitened.projected()
        self._sided = [c.one_sided for c in screened.output_changes]
        self._count, self._choices = count, len(screened.candidates)
        self._candidates = [s for s in screened.candidates if s.effect.kind not in excluded]

    def _value(self, chosen: Sequence[ScreenedCandidate]) -> float:
        """Fall of the extended BIC."""
        at = [i for s in chosen for i in s.output_changes]
        paid = sum(
            price(s.degrees_of_freedom, self._count, s.trial_count * self._choices) for s in chosen
        )
        return explained_by(self._whitened, at, [self._sided[i] for i in at]).cost_reduction - paid

    def _unwhitened_reduction(self, chosen: Sequence[ScreenedCandidate]) -> float:
        at = [i for s in chosen for i in s.output_changes]
        return explained_by(self._unwhitened, at, [self._sided[i] for i in at]).cost_reduction

    def _compatible(self, chosen: Sequence[ScreenedCandidate]) -> list[ScreenedCandidate]:
        """Candidates that may join a set: neither members, nor effects that contain or are part of
        one."""
        have = {s.effect.kind for s in chosen}
        parts = {kind for s in chosen for kind in s.effect.includes}
        return [
            s
            for s in self._candidates
            if s.effect.kind not in have | parts and not have & set(s.effect.includes)
        ]

    def best_addition(self, chosen: Sequence[ScreenedCandidate]) -> ScreenedCandidate | None:
        before = self._value(chosen) if chosen else 0.0
        additions = [(self._value([*chosen, s]), s) for s in self._compatible(chosen)]
        value, best = max(additions, key=lambda pair: pair[0], default=(before, None))
        return best if value > before else None

    def exchanged(self, chosen: list[ScreenedCandidate]) -> list[ScreenedCandidate]:
        """The set after exchanges of members, as long as each explains more."""
        before: list[ScreenedCandidate] = []
        while chosen != before:  # each exchange raises the value, so that they end
            before = chosen
            for place in range(len(chosen)):
                others = [*chosen[:place], *chosen[place + 1 :]]
                options = [chosen[place], *self._compatible(chosen)]
                best = max(options, key=lambda s: self._value([*others, s]))  # noqa: B023
                chosen = [*chosen[:place], best, *chosen[place + 1 :]]
        return chosen

    def ordered(self, chosen: Sequence[ScreenedCandidate]) -> list[ScreenedCandidate]:
        remaining, order = list(chosen), list[ScreenedCandidate]()
        while remaining:
            best = max(remaining, key=lambda s: self._unwhitened_reduction([*order, s]))
            order.append(best)
            remaining.remove(best)
        return order
