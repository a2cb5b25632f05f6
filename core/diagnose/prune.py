"""Backward removal: an early step may have become needless through a later one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from core.diagnose.data import Data, hypothesis
from core.diagnose.evidence import RELEVANT
from core.diagnose.refit import Refit, fit, settled
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
    """Takes out each effect, but the last added, without which the error hardly grows.

    The first `given` are what the user put into the model: they stay.
    """
    # As finely simulated as what it is compared with: no model may win by its steps.
    alike = replace(data, steps=refit.hypothesis.steps)
    kept, removed = list(range(len(present))), []
    for place in range(given, len(present) - 1):
        if stopped():
            break
        one, left = present[place], [k for k in kept if k != place]
        others = [present[k] for k in left]
        if any(one.kind in e.includes for e in others):
            continue
        start = hypothesis(alike, others, refit.hypothesis.values())
        tried = fit(start, None, stopped, ITERATIONS)
        if tried.cost - refit.cost < RELEVANT * data.count:
            kept, refit = left, settled(tried)
            removed.append(one)
    return Kept(refit, tuple(present[k] for k in kept)), tuple(removed)
