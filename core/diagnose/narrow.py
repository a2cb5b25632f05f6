"""Sizes without a slope at neutral: where a refit begins, so that it ends in the right valley."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from core.diagnose.data import Data, Hypothesis, hypothesis
from core.diagnose.descent import cost_of
from core.diagnose.resonance import resonant_sizes
from core.effects.effect import Effect

CLOSER = 1.15
"""Ratio of neighbouring sizes in the second scan: a spring that swings ten times in a recording
has its best fit in a valley a tenth of its frequency wide, which is a fifth of its compliance."""


class Scan(NamedTuple):
    """A size that is sought over a grid, and what it is a part of."""

    data: Data
    base: Hypothesis
    effects: Sequence[Effect]
    values: Mapping[str, float]
    name: str
    grid: tuple[float, ...]
    """That the screen tries, in order."""

    @property
    def size(self) -> float:
        """Where it stands."""
        return self.values[self.name]


def narrowed(
    data: Data,
    base: Hypothesis,
    effects: Sequence[Effect],
    values: Mapping[str, float],
    scanned: Sequence[str],
    stopped: Callable[[], bool] = lambda: False,
) -> dict[str, float]:
    """The values with each scanned size moved to the best around it, one by one: of the sizes that
    the screen tried, of those at which the arm would swing as the error of `base` does, and of
    those between the best's neighbours."""
    best = dict(values)
    cost = _cost_at(data, effects, best) if scanned else np.inf
    grids = _grids(data, effects)
    for name in scanned:
        for sizes in (_others, _swinging, _between):
            for size in sizes(Scan(data, base, effects, best, name, grids.get(name, ()))):
                if stopped():
                    return best
                tried = {**best, name: size}
                found = _cost_at(data, effects, tried)
                if found < cost:
                    best, cost = tried, found
    return best


def _grids(data: Data, effects: Sequence[Effect]) -> dict[str, tuple[float, ...]]:
    """parameter -> the sizes that the screen tries, in order."""
    arm = data.bare.with_effects(effects).arm
    knobs = [k for one in effects for k in one.parameters(arm, data.bare.drive, data.sizes)]
    return {k.parameter.name: tuple(sorted(k.grid)) for k in knobs}


def _others(scan: Scan) -> list[float]:
    """The other sizes of the grid; a zero or another sign is another effect."""
    return [x for x in scan.grid if x * scan.size > 0.0 and x != scan.size]


def _swinging(scan: Scan) -> list[float]:
    """Sizes within the grid at which the arm swings as the error does."""
    known = [*_others(scan), scan.size]
    if len(known) < 2 or scan.size < 0.0:
        return []
    wide = (min(known), max(known))
    return resonant_sizes(scan.data, scan.base, scan.effects, scan.values, scan.name, wide)


def _between(scan: Scan) -> list[float]:
    """Sizes between a size's neighbours in the grid, with at most CLOSER between them."""
    if not scan.size:
        return []
    known = sorted(abs(x) for x in (*_others(scan), scan.size))
    at = known.index(abs(scan.size))
    widest = max((b / a for a, b in zip(known, known[1:], strict=False)), default=CLOSER**4)
    low = known[at - 1] if at > 0 else known[at] / widest
    high = known[at + 1] if at + 1 < len(known) else known[at] * widest
    count = int(np.ceil(np.log(high / low) / np.log(CLOSER))) + 1
    return [float(np.sign(scan.size) * x) for x in np.geomspace(low, high, count)[1:-1]]


def _cost_at(data: Data, effects: Sequence[Effect], values: Mapping[str, float]) -> float:
    h = hypothesis(data, effects, values).coarse
    return cost_of(h.errors(h.vector))
