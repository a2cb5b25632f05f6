"""Which refits go on: after a few steps each, what cannot come close to the leader any more is out.

A ranking needs the figures of those that might be named. What is left far behind keeps the figures
that it has: where it stopped it was told from the best by more than its next step could bring.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from core.diagnose.data import Data, Hypothesis
from core.diagnose.evidence import CLOSE, merit
from core.diagnose.refit import ROUGH_ITERATIONS, Known, Refit, ahead, columns_of, exactly, fit
from core.diagnose.valleys import better_valley
from core.diagnose.whitening import Whitener
from core.effects.effect import Effect
from core.identify.least_squares import promised

FIRST = 2
"""Iterations of everybody: the first goes to where straight lines lead, the second tells how far
that was right."""

OPTIMISM = 2.0
"""Times the reduction that straight lines promise next: a descent whose steps halve what is left
ends there, and what converges more slowly does not compete with what is ahead by CLOSE in merit."""


@dataclass(frozen=True)
class Runner:
    """A refit under way."""

    refit: Refit
    left: int
    """Iterations that it may still take."""
    known: Known

    @property
    def bound(self) -> float:
        """The least cost that may still be hoped for."""
        found, h = self.refit.descended, self.refit.hypothesis
        if not np.isfinite(found.cost):
            return np.inf
        return found.cost - OPTIMISM * promised(found, h.limits)


def started(
    data: Data,
    base: Hypothesis,
    effects: Sequence[Effect],
    values: Mapping[str, float],
    slopes: Sequence[np.ndarray],
    scanned: Sequence[str],
    stopped: Callable[[], bool],
) -> Runner:
    """The first steps of `core.diagnose.refit.refit_with`."""
    known = columns_of(base, slopes)
    start, spent = ahead(data, base, effects, values, slopes, scanned, stopped)
    left = ROUGH_ITERATIONS - spent
    return Runner(fit(start, None, stopped, FIRST, known), left - FIRST, known)


def in_its_best_valley(data: Data, runner: Runner, stopped: Callable[[], bool]) -> Runner:
    """The same from where another minimum of the cost is lower. A finer model of the arm is softer:
    with the stiffness of the coarse one it swings too slowly, and descents lead elsewhere."""
    start = better_valley(data, runner.refit.hypothesis, stopped)
    if start is None or stopped():
        return runner
    return replace(runner, refit=fit(start, None, stopped, FIRST, runner.known))


def ended(
    data: Data, runner: Runner, goes_on: bool, whitener: Whitener, stopped: Callable[[], bool]
) -> Refit:
    """Its refit, with the steps that it has left where it `goes_on` and is not at its end: what
    wins is what it would be without a race."""
    found = runner.refit
    if goes_on and not found.descended.ended:
        at, damping = found.hypothesis, found.descended.damping
        found = fit(at, None, stopped, runner.left, runner.known, damping)
    return exactly(data, found, whitener)


def in_the_race(runners: Sequence[Runner], base: Refit, count: int) -> list[bool]:
    """Whether each may still come within CLOSE of the best, by merit over `count` samples."""
    own = [len(r.refit.hypothesis.unknowns) - len(base.hypothesis.unknowns) for r in runners]

    def merit_at(cost: float, parameters: int) -> float:
        return merit(base.cost, cost, count, parameters)

    best = min((merit_at(r.refit.cost, n) for r, n in zip(runners, own, strict=True)), default=0.0)
    return [merit_at(r.bound, n) <= best + CLOSE for r, n in zip(runners, own, strict=True)]
