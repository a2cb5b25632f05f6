"""Sizes without a slope at neutral: where a refit begins, so that it ends in the right valley."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple, TypeVar

import numpy as np

from core.diagnose.data import Data, Hypothesis, hypothesis
from core.diagnose.resonance import resonant_sizes
from core.effects.effect import Effect
from core.identify.least_squares import cost_of
from core.lanes.wide import LANES

T = TypeVar("T")

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
    cost = costs(data, effects, [best])[0] if scanned else np.inf
    grids = _grids(data, effects)
    for name in scanned:
        for sizes in (_others, _swinging, _between):
            scan = Scan(data, base, effects, best, name, grids.get(name, ()))
            for some in batched(sizes(scan), TOGETHER):
                if stopped():
                    return best
                tried = [{**best, name: size} for size in some]
                found = costs(data, effects, tried)
                least = int(np.argmin(found))
                if found[least] < cost:
                    best, cost = tried[least], found[least]
    return best


TOGETHER = LANES
"""Of them between two looks at whether the search was stopped: one recording fills the lanes."""


def batched(sizes: Sequence[T], count: int) -> Iterator[Sequence[T]]:
    """Up to `count` of them at a time."""
    for first in range(0, len(sizes), count):
        yield sizes[first : first + count]


def _grids(data: Data, effects: Sequence[Effect]) -> dict[str, tuple[float, ...]]:
    """parameter -> the sizes that the screen tries, in order."""
    arm = data.bare.with_effects(effects).arm
    effect_parameters = [
        k for one in effects for k in one.parameters(arm, data.bare.drive, data.sizes)
    ]
    return {k.parameter.name: tuple(sorted(k.grid)) for k in effect_parameters}


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


def costs(
    data: Data, effects: Sequence[Effect], tried: Sequence[Mapping[str, float]]
) -> list[float]:
    """Weighted squared error at each of some sets of values; those that differ in unknowns only
    are simulated together."""
    places = [hypothesis(data, effects, values).coarse for values in tried]
    if not all(_differ_in_unknowns(places[0], h) for h in places):
        return [cost_of(h.errors(h.vector)) for h in places]
    return [cost_of(errors) for errors in places[0].errors_of([h.vector for h in places])]


def _differ_in_unknowns(a: Hypothesis, b: Hypothesis) -> bool:
    """Whether one is the other at another vector."""

    def fixed(h: Hypothesis) -> dict[str, float]:
        known = h.model.effect_values
        return {name: x for name, x in known.items() if name not in h.unknowns.labels}

    return a.unknowns.labels == b.unknowns.labels and a.steps == b.steps and fixed(a) == fixed(b)
