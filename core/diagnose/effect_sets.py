"""Which effects together explain the error: a search over the products of all columns at once.

One whitened Gram matrix answers what any set of columns explains, so sets are compared without a
simulation. Forward selection with exchange: a stand-in that comes first loses its place to the
pair that is true. What is chosen is refitted jointly afterwards.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from ..diagnose.gram_matrix import explain
from ..diagnose.linear_screen import Screen, Screened

MOST_TOGETHER = 4
"""Effects of one set: linear predictions of more say little before a refit."""

SHORTLIST = 12
"""Candidates from which sets are made, the best alone by evidence and by the plain error."""

EXCHANGES = 6
"""Rounds of exchange; two or three end it."""


@dataclass(frozen=True)
class FoundSet:
    """Effects that explain the error together, as far as straight lines tell."""

    members: tuple[Screened, ...]
    """In the order in which each adds most to those before it."""
    plain_drop: float
    """Reduction of the squared error, in floors squared."""


def best_set(seen: Screen, most: int, count: int, without: Collection[str] = ()) -> FoundSet:
    """The set of at most `most` effects with the best BIC over `count` samples; `without` some
    kinds of effect."""
    search = _Search(seen, count, without)
    chosen: list[Screened] = []
    while len(chosen) < min(most, MOST_TOGETHER):
        best = search.best_addition(chosen)
        if best is None:
            break
        chosen = search.exchanged([*chosen, best])
    chosen = search.ordered(chosen)
    return FoundSet(tuple(chosen), search.plain_drop(chosen))


class _Search:
    def __init__(self, seen: Screen, count: int, without: Collection[str]) -> None:
        self._white, self._plain = seen.white.projected(), seen.plain.projected()
        self._sided = [c.one_sided for c in seen.columns]
        self._price = float(np.log(max(count, 2)))
        self._choice = 2.0 * float(np.log(max(len(seen.candidates), 1)))
        left = [s for s in seen.candidates if s.effect.kind not in without]
        by_score = sorted(left, key=lambda s: -s.score)
        by_drop = sorted(left, key=lambda s: -s.drop)
        listed = {s.effect.kind: s for pair in zip(by_score, by_drop, strict=True) for s in pair}
        self._candidates = list(listed.values())[:SHORTLIST]

    def _value(self, chosen: Sequence[Screened]) -> float:
        """Reduction of the whitened squared error minus the price of what is free, and of the
        choice among many (extended BIC, Chen and Chen, Biometrika 95, 2008)."""
        at = [i for s in chosen for i in s.columns]
        each = (s.freedom * self._price + 2.0 * np.log(max(s.tried, 1.0)) for s in chosen)
        price = sum(each) + len(chosen) * self._choice
        return explain(self._white, at, [self._sided[i] for i in at]).drop - price

    def plain_drop(self, chosen: Sequence[Screened]) -> float:
        at = [i for s in chosen for i in s.columns]
        return explain(self._plain, at, [self._sided[i] for i in at]).drop

    def _compatible(self, chosen: Sequence[Screened]) -> list[Screened]:
        """What may join a set: not what is in it, nor what contains or is part of a member."""
        have = {s.effect.kind for s in chosen}
        parts = {kind for s in chosen for kind in s.effect.includes}
        return [
            s
            for s in self._candidates
            if s.effect.kind not in have | parts and not have & set(s.effect.includes)
        ]

    def best_addition(self, chosen: Sequence[Screened]) -> Screened | None:
        before = self._value(chosen) if chosen else 0.0
        found = [(self._value([*chosen, s]), s) for s in self._compatible(chosen)]
        value, best = max(found, key=lambda one: one[0], default=(before, None))
        return best if value > before else None

    def exchanged(self, chosen: list[Screened]) -> list[Screened]:
        """With members replaced by others as long as that explains more."""
        for _ in range(EXCHANGES):
            before = chosen
            for place in range(len(chosen)):
                rest = [*chosen[:place], *chosen[place + 1 :]]
                tried = [chosen[place], *self._compatible(chosen)]
                best = max(tried, key=lambda s: self._value([*rest, s]))  # noqa: B023
                chosen = [*chosen[:place], best, *chosen[place + 1 :]]
            if chosen == before:
                break
        return chosen

    def ordered(self, chosen: Sequence[Screened]) -> list[Screened]:
        left, order = list(chosen), list[Screened]()
        while left:
            best = max(left, key=lambda s: self.plain_drop([*order, s]))
            order.append(best)
            left.remove(best)
        return order
