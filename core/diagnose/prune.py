"""Backward removal: an early step may have become needless through a later one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from core.diagnose.data import Data, hypothesis
from core.diagnose.evidence import RELEVANT
from core.diagnose.refit import Refit, fit, settled
from core.effects import effect
from core.effects.effect import Effect

ITERATIONS = 6


@dataclass(frozen=True)
class Kept:
    """A model without what it does not need."""

    refit: Refit
    effects: tuple[Effect, ...]


def without_needless(
    data: Data,
    refit: Refit,
    present: Sequence[Effect],
    given: int,
    stopped: Callable[[], bool],
) -> tuple[Kept, tuple[Effect, ...]]:
    """Takes out each effect without which the error hardly grows, or puts the simpler ones that it
    includes in its place.

    The last added too: an effect of no size can lead the others out of a minimum that they were
    stuck in. The first `given` are what the user put into the model: they stay.
    """
    kept: list[tuple[Effect, ...]] = [(one,) for one in present]
    removed: list[Effect] = []
    for place in range(given, len(present)):
        for instead in _instead(kept, place):
            if stopped():
                break
            tried = [*kept[:place], instead, *kept[place + 1 :]]
            start = hypothesis(data, _flat(tried), refit.hypothesis.values())
            found = fit(start, None, stopped, ITERATIONS)
            if found.cost - refit.cost < RELEVANT * data.count:
                kept, refit = tried, settled(found)
                removed.append(present[place])
                break
    return Kept(refit, _flat(kept)), tuple(removed)


def _flat(places: Sequence[tuple[Effect, ...]]) -> tuple[Effect, ...]:
    return tuple(one for place in places for one in place)


def _instead(kept: Sequence[tuple[Effect, ...]], place: int) -> list[tuple[Effect, ...]]:
    """What may stand in an effect's place: nothing, or what it includes; it stays where others
    need it."""
    (one,) = kept[place]
    others = _flat([*kept[:place], *kept[place + 1 :]])
    if any(one.kind in e.includes for e in others):
        return []
    have = {e.kind for e in others}
    simpler = tuple(effect(kind) for kind in one.includes if kind not in have)
    return [(), *([simpler] if simpler else [])]
