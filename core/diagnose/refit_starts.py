"""Where a refit begins: from several starts, over a horizon that grows.

A fit that lacks an effect bends what it has, so with the effect added it begins from where the
model without it stands and from the nominal values, each with the sizes that the screen found.

A soft base, an elastic joint or play also swings. The fit that lacked it put the beams' own
vibration where the recordings swing most, and over whole recordings the cost has a minimum wherever
model and recording meet again after some more or fewer swings. Over the first swings there is one
wide valley (core.identify.refinement), so there the starts are told apart, all sizes of the
screen's grid and between them among these; what is best goes on over more of each recording.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TypeVar

import numpy as np

from ..arm.arm import Structure
from ..diagnose.fit_problem import Data, Hypothesis, hypothesis, names_of
from ..effects.effect import Effect
from ..identify.refinement import FEWEST, SHARES, beginnings
from ..lanes.wide import LANES
from ..least_squares import cost_of, descend, normal_equations, pseudo_inverse, whole

T = TypeVar("T")

CLOSER = 1.15
"""Ratio of neighbouring sizes that are compared: a spring that swings ten times in a recording has
its best fit in a valley a tenth of its frequency wide, which is a fifth of its compliance."""

LOOK = 3
"""Iterations from each start before the best go on."""

BEST = 3
"""Starts that go on."""

ROUGH_ITERATIONS = 10
"""Of a fit that is only compared with others; what is accepted is converged afterwards."""

LONGER = 4
"""Times as much of each recording for the last descent, so that what begins on the whole is out of
step by no more than a part of a swing."""

SHOWN = 10.0
"""Squared error above that of noise, in noise floors and per unknown, that a beginning must hold to
say where a refit begins: a recording may begin at rest."""

MOVED = 0.02
"""Share by which a parameter must have left its nominal value for another start to be worth it."""

Values = dict[str, float]
"""label -> value"""


def starts(
    data: Data,
    base: Hypothesis,
    effects: Sequence[Effect],
    values: Mapping[str, float],
    scanned: Sequence[str],
    stopped: Callable[[], bool],
) -> list[Values]:
    """Starts of the model with `effects`, whose other sizes are `values`, over whole recordings.

    Args:
        data: the recordings, in noise floors.
        base: the model without the last effect, at its minimum.
        effects: those of the new model, the new one last.
        values: where the screen would begin.
        scanned: the parameters among `values` that come from a grid.
        stopped: whether to give up.

    Returns:
        The first begins where the base stands.
    """
    begun = {**base.values(), **values}
    elsewhere = _elsewhere(data, base.values())
    horizon = Horizon.that_shows(data, base, effects, values, stopped)
    if horizon is None:
        return [{**begun, **arm} for arm in elsewhere]
    first = horizon.best(grid_sizes(data, effects, scanned), begun, elsewhere)
    return [begun] if first is None else [begun, first]


def from_nominal_values(data: Data, h: Hypothesis, stopped: Callable[[], bool]) -> Values | None:
    """A start of a fitted model in another valley than where it stands: where descents over the
    first swings lead, from there and from the nominal values.

    Returns:
        None where nothing swings, where the nominal values are near, or where the first swings are
        met as well from where it stands.
    """
    arm, at = h.model.arm, h.values()
    if arm.coordinates == arm.joints or not has_moved(data, at):
        return None
    share = _shown_within(data, h, len(h.vector))
    if share is None:
        return None
    horizon = Horizon(data, h.model.effects, share, (), stopped)
    values = {**h.model.effect_values, **at}
    stands, _ = horizon.descended(values, 0)
    tried = [horizon.descended({**values, **arm}, ROUGH_ITERATIONS) for arm in _elsewhere(data, at)]
    best = min(tried, key=lambda one: one[0])
    if not (stands - best[0]) * horizon.first.count >= SHOWN * len(h.vector):
        return None
    return horizon.longer(best)


def has_moved(data: Data, values: Mapping[str, float]) -> bool:
    """Whether a nominal parameter stands elsewhere."""
    return any(abs(values.get(k, x) - x) > MOVED * abs(x) for k, x in nominal_values(data).items())


def nominal_values(data: Data) -> Values:
    """label -> value of what all recordings share, as it was stated."""
    return {u.label: u.parameter.value for u in data.nuisance if u.recording is None}


def _elsewhere(data: Data, at: Mapping[str, float]) -> list[Values]:
    """What changes from where a model stands to where a fit may begin: nothing, or the nominal
    values where they are others."""
    return [{}, nominal_values(data)] if has_moved(data, at) else [{}]


@dataclass(frozen=True)
class Horizon:
    """Models with `effects` over the first `share` of each recording; sizes that are `held` stay:
    a limit that no beginning reaches runs away."""

    data: Data
    effects: Sequence[Effect]
    share: float
    held: Collection[str]
    stopped: Callable[[], bool]

    @classmethod
    def that_shows(
        cls,
        data: Data,
        base: Hypothesis,
        effects: Sequence[Effect],
        values: Mapping[str, float],
        stopped: Callable[[], bool],
    ) -> Horizon | None:
        """None where the last effect leaves the arm's vibrations as they are, or where no beginning
        of the recordings says enough."""
        model = data.bare.with_effects(effects, {**values}, data.sizes)
        own = names_of(effects[-1], model, data.sizes)
        other_arm = Structure.of(model.arm) != Structure.of(base.model.arm)
        if not other_arm and model.arm_catalogue.entries.keys().isdisjoint(own):
            return None
        share = _shown_within(data, base, len(hypothesis(data, effects, values).vector))
        held = tuple(base.model.effect_parameters)
        return None if share is None else cls(data, effects, share, held, stopped)

    @cached_property
    def first(self) -> Data:
        """The comparison over the beginnings."""
        return beginning(self.data, self.share)

    def best(
        self, sizes: Sequence[Values], begun: Mapping[str, float], elsewhere: Sequence[Values]
    ) -> Values | None:
        """Where the best of all starts leads: with each change `elsewhere` of `begun` the sizes
        that it has and those, of some `sizes`, whose cost is below that of their neighbours."""
        found: list[Values] = []
        for arm in elsewhere:
            at = {**begun, **arm}
            found += [at, *self.valleys(at, sizes)]
        distinct = [one for k, one in enumerate(found) if one not in found[:k]]
        looks = sorted((self.descended(one, LOOK) for one in distinct), key=lambda one: one[0])
        ended = [self.descended(one, ROUGH_ITERATIONS) for _, one in looks[:BEST]]
        return self.longer(min(ended, key=lambda one: one[0]))

    def descended(self, values: Mapping[str, float], most: int) -> tuple[float, Values]:
        """Cost per sample and values after at most so many iterations."""
        h = _free(self.first, self.effects, values, self.held).coarse
        found = descend(h.errors, h.slopes, h.vector, h.limits, self.stopped, most=most)
        return found.cost / self.first.count, {**values, **h.at(found.vector).values()}

    def longer(self, found: tuple[float, Values]) -> Values | None:
        """Where a start leads over more of each recording, all sizes free; None where it went
        astray."""
        cost, best = found
        if LONGER * self.share < 1.0:
            more = replace(self, share=LONGER * self.share, held=())
            cost, best = more.descended(best, ROUGH_ITERATIONS)
        return best if np.isfinite(cost) else None

    def valleys(self, at: Values, sizes: Sequence[Values]) -> list[Values]:
        """The best of some sizes among their neighbours, all other unknowns following."""
        h = _free(self.first, self.effects, at, self.held)
        labels = h.unknowns.labels
        tried = [{n: x for n, x in size.items() if n in labels} for size in sizes]
        if not any(tried):
            return []
        along = [labels.index(n) for n in tried[0]]
        vectors = np.repeat(h.vector[None], len(tried), axis=0)
        vectors[:, along] = [list(one.values()) for one in tried]
        ends = followed(h, along, list(vectors), self.stopped)
        edged = [np.inf, *(cost for cost, _ in ends), np.inf]
        lowest = [k for k in range(len(ends)) if edged[k] > edged[k + 1] <= edged[k + 2]]
        best = sorted(lowest, key=lambda k: ends[k][0])[:BEST]
        return [{**at, **h.at(ends[k][1]).values()} for k in best]


def beginning(data: Data, share: float) -> Data:
    """The same comparison over the first `share` of each recording."""
    return replace(data, experiments=tuple(beginnings(data.experiments, share)), anchor=None)


def _shown_within(data: Data, base: Hypothesis, unknowns: int) -> float | None:
    """The least share of each recording over which the error of `base` is more than noise."""
    errors = base.errors(base.vector)
    for share in SHARES:
        cost, count = 0.0, 0
        for e, r in zip(data.experiments, errors, strict=True):
            part = slice(0, int(np.ceil(share * len(r))))
            cost += float(np.sum(np.square(r[part])))
            count += int(e.counted[part].sum())
        if count >= FEWEST * unknowns and cost > count + SHOWN * unknowns:
            return share if beginning(data, share).experiments else None
    return None


def _free(
    data: Data, effects: Sequence[Effect], values: Mapping[str, float], held: Collection[str]
) -> Hypothesis:
    """The model with `effects` where all is free but the sizes that are `held`."""
    h = hypothesis(data, effects, values)
    if not held:
        return h
    nominal = {u.parameter.name for u in data.nuisance}
    named = [u for u in h.unknowns.items if u.parameter.name not in nominal]
    free = tuple(u for u in named if u.parameter.name not in held)
    return hypothesis(data, effects, values, freed=free)


def grid_sizes(data: Data, effects: Sequence[Effect], scanned: Sequence[str]) -> list[Values]:
    """The sizes that the screen tries, of all `scanned` parameters by place in their grids, and
    between two of them so many that neighbours differ by CLOSER at most."""
    arm = data.bare.with_effects(effects).arm
    known = [k for one in effects for k in one.parameters(arm, data.bare.drive, data.sizes)]
    grids = {k.parameter.name: sorted(k.grid) for k in known if k.parameter.name in scanned}
    grids = {name: grid for name, grid in grids.items() if grid}
    places = range(max((len(grid) for grid in grids.values()), default=0))
    return list(closely([{n: g[min(i, len(g) - 1)] for n, g in grids.items()} for i in places]))


def closely(places: Sequence[Mapping[str, float]]) -> Iterator[Values]:
    """The places, and between two of them so many that neighbours differ by CLOSER at most."""
    for a, b in pairwise(places):
        ratios = [b[n] / a[n] for n in a if a[n] * b[n] > 0.0]
        count = max((int(np.ceil(abs(np.log(x)) / np.log(CLOSER))) for x in ratios), default=1)
        for share in np.arange(count) / count:
            yield {
                n: float(a[n] * (b[n] / a[n]) ** share if a[n] * b[n] > 0.0 else a[n]) for n in a
            }
    yield from (dict(last) for last in places[-1:])


def followed(
    h: Hypothesis,
    along: Collection[int],
    vectors: Sequence[np.ndarray],
    stopped: Callable[[], bool] = lambda: False,
) -> list[tuple[float, np.ndarray]]:
    """The cost at each of `vectors`, which differ in the unknowns with the numbers `along`, with
    the other unknowns where straight lines take them, and the vector (P,) there; fewer where it is
    stopped.

    Seen with the others held, the valley in which the truth lies may be no valley at all: a first
    beam bent by 2 % hid that of the second. The others' slopes are those of one place: beside a
    valley they hide it, and in it they are right enough to show it. So are few steps.
    """
    others, limits = ~np.isin(np.arange(len(h.vector)), list(along)), h.limits
    theirs = [whole(S)[:, :, others] for S in h.slopes(h.vector)]
    found: list[tuple[float, np.ndarray]] = []
    for some in batched(vectors, LANES):
        if stopped():
            break
        for x, errors in zip(some, h.coarse.errors_of(some), strict=True):
            A, b = normal_equations([whole(e) for e in errors], theirs)
            inverse = pseudo_inverse(A)
            there = x.copy()
            there[others] -= inverse @ b
            cost = cost_of(errors) - float(b @ inverse @ b)
            found.append((cost, np.clip(there, limits.lower, limits.upper)))
    return found


def batched(items: Sequence[T], count: int) -> Iterator[Sequence[T]]:
    """Up to `count` of them at a time: one recording fills the lanes."""
    for first in range(0, len(items), count):
        yield items[first : first + count]
