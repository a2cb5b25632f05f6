"""Which effects together explain the error, by a search over all output changes.

The whitened Gram matrix shows what any set explains, so sets need no simulation. Forward selection
with exchange: an imitation that came first is replaced by the true pair. The chosen set is then
refitted.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from ..diagnose.evidence import price
from ..diagnose.gram_matrix import explained_by
from ..diagnose.linear_screen import Screen, ScreenedCandidate

MOST_TOGETHER = 4
"""Effects of one set: linear predictions of more say little."""

SHORTLIST = 12
"""Candidates for sets: the best by evidence and by expected reduction."""

EXCHANGES = 6
"""Rounds of exchange; two or three end it."""


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
        allowed = [s for s in screened.candidates if s.effect.kind not in excluded]
        by_score = sorted(allowed, key=lambda s: -s.score)
        by_reduction = sorted(allowed, key=lambda s: -s.cost_reduction)
        listed = {
            s.effect.kind: s for pair in zip(by_score, by_reduction, strict=True) for s in pair
        }
        self._candidates = list(listed.values())[:SHORTLIST]

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
        for _ in range(EXCHANGES):
            before = chosen
            for place in range(len(chosen)):
                others = [*chosen[:place], *chosen[place + 1 :]]
                options = [chosen[place], *self._compatible(chosen)]
                best = max(options, key=lambda s: self._value([*others, s]))  # noqa: B023
                chosen = [*chosen[:place], best, *chosen[place + 1 :]]
            if chosen == before:
                break
        return chosen

    def ordered(self, chosen: Sequence[ScreenedCandidate]) -> list[ScreenedCandidate]:
        remaining, order = list(chosen), list[ScreenedCandidate]()
        while remaining:
            best = max(remaining, key=lambda s: self._unwhitened_reduction([*order, s]))
            order.append(best)
            remaining.remove(best)
        return order
