"""Backward removal: an early step may have become needless through a later one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from core.diagnose.data import Data, hypothesis
from core.diagnose.evidence import RELEVANT
from core.diagnose.refit import Refit, fit
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
    given: Sequence[Effect],
    stopped: Callable[[], bool],
) -> tuple[Kept, tuple[Effect, ...]]:
    """Takes out each effect, but the last added, without which the error hardly grows.

    `given`: what the user put into the model stays.
    """
    effects, removed = list(present), []
    for one in list(present)[:-1]:
        if stopped():
            break
        others = [e for e in effects if e is not one]
        if any(one.kind in e.includes for e in others) or one in given:
            continue
        tried = fit(hypothesis(data, others, refit.hypothesis.values()), None, stopped, ITERATIONS)
        if tried.cost - refit.cost < RELEVANT * data.count:
            effects, refit = others, tried
            removed.append(one)
    return Kept(refit, tuple(effects)), tuple(removed)
