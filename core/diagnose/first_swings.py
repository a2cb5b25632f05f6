"""Where a refit of something that swings begins: from the first swings of each recording.

A fit that lacks a soft base, an elastic joint or play puts the beams' own vibration where the
recordings swing most. With the effect added that vibration belongs elsewhere, and over whole
recordings the cost has a minimum wherever model and recording meet again after some more or fewer
swings. Over the first swings there is one wide valley (core.identify.growing): descents from the
sizes that the screen tried and from both sets of nominal values meet there.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from core.arm.structure import Structure
from core.diagnose.data import Data, Hypothesis, hypothesis, names_of
from core.diagnose.narrow import CLOSER, TOGETHER, batched
from core.diagnose.profile import followed
from core.effects.effect import Effect
from core.identify.growing import FEWEST, SHARES, beginnings
from core.identify.least_squares import descend, whole

LOOK = 3
"""Iterations from each start before the best go on."""

BEST = 3
"""Starts that go on."""

ITERATIONS = 8
"""Of those; they end earlier where they converge."""

LONGER = 4
"""Times as much of each recording for the last descent, so that what begins on the whole is out of
step by no more than a part of a swing."""

SHOWN = 10.0
"""Squared error above that of noise, in noise floors and per unknown, that a beginning must hold to
say where a refit begins: a recording may begin at rest."""

Start = dict[str, float]
"""label -> value"""


def from_first_swings(
    data: Data,
    base: Hypothesis,
    effects: Sequence[Effect],
    values: Mapping[str, float],
    scanned: Sequence[str],
    stopped: Callable[[], bool],
) -> Start | None:
    """A start of the model with `effects`, whose other sizes are `values`.

    Args:
        base: the model without the last effect, at its minimum.
        scanned: the parameters among `values` that come from a grid.

    Returns:
        None where the last effect leaves the arm's vibrations as they are, or where no beginning of
        the recordings says enough.
    """
    if not _swings(data, base, effects, values):
        return None
    share = _shown_within(data, base, len(hypothesis(data, effects, values).vector))
    if share is None:
        return None
    first = _begun(data, share)
    # Sizes that are known already stay at first: a limit that no beginning reaches runs away.
    held = set(base.model.effect_parameters)
    starts = _starts(first, base, effects, values, scanned, held)
    looks = [_descended(first, effects, one, LOOK, stopped, held) for one in starts]
    looks = sorted(looks, key=lambda one: one[0])[:BEST]
    ended = [_descended(first, effects, one, ITERATIONS, stopped, held) for _, one in looks]
    return _longer(data, effects, min(ended, key=lambda one: one[0]), share, stopped)


def _swings(
    data: Data, base: Hypothesis, effects: Sequence[Effect], values: Mapping[str, float]
) -> bool:
    """Whether the last of the effects has a vibration of its own, or moves those of the arm."""
    model = data.bare.with_effects(effects, {**values}, data.sizes)
    own = names_of(effects[-1], model, data.sizes)
    other_arm = Structure.of(model.arm) != Structure.of(base.model.arm)
    return other_arm or not model.arm_catalogue.entries.keys().isdisjoint(own)


def from_nominal_values(data: Data, h: Hypothesis, stopped: Callable[[], bool]) -> Start | None:
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
    effects, values = h.model.effects, {**h.model.effect_values, **at}
    first, elsewhere = _begun(data, share), {**values, **nominal_values(data)}
    stands, _ = _descended(first, effects, values, 0, stopped)
    ended = [_descended(first, effects, x, ITERATIONS, stopped) for x in (values, elsewhere)]
    best = min(ended, key=lambda one: one[0])
    if not (stands - best[0]) * first.count >= SHOWN * len(h.vector):
        return None
    return _longer(data, effects, best, share, stopped)


MOVED = 0.02
"""Share by which a parameter must have left its nominal value for another start to be worth it."""


def has_moved(data: Data, values: Mapping[str, float]) -> bool:
    """Whether a nominal parameter stands elsewhere."""
    return any(abs(values.get(k, x) - x) > MOVED * abs(x) for k, x in nominal_values(data).items())


def nominal_values(data: Data) -> Start:
    """label -> value of what all recordings share, as it was stated."""
    return {u.label: u.parameter.value for u in data.nuisance if u.recording is None}


def _longer(
    data: Data,
    effects: Sequence[Effect],
    found: tuple[float, Start],
    share: float,
    stopped: Callable[[], bool],
) -> Start | None:
    """Where a start that was found over the first `share` of each recording leads over more of it,
    all sizes free; None where it went astray."""
    cost, best = found
    if LONGER * share < 1.0:
        longer = _begun(data, LONGER * share)
        cost, best = _descended(longer, effects, best, ITERATIONS, stopped)
    return best if np.isfinite(cost) else None


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
            return share if _begun(data, share).experiments else None
    return None


def _begun(data: Data, share: float) -> Data:
    """The same comparison over the first `share` of each recording."""
    return replace(data, experiments=tuple(beginnings(data.experiments, share)), anchor=None)


def _starts(
    data: Data,
    base: Hypothesis,
    effects: Sequence[Effect],
    values: Mapping[str, float],
    scanned: Sequence[str],
    held: Collection[str],
) -> list[Start]:
    """Where the base ended and the nominal values, each with the sizes that the screen found best
    and those that are the best of their neighbours over `data`, a beginning of the recordings."""
    sizes = list(_closely(_places(data, effects, scanned)))
    standing = base.values()
    others = [{}, nominal_values(data)] if has_moved(data, standing) else [{}]
    found: list[Start] = []
    for arm_values in others:
        at = {**standing, **arm_values, **values}
        found += [at, *_lowest(_free(data, effects, at, held), at, sizes)]
    return [one for k, one in enumerate(found) if one not in found[:k]]


def _lowest(h: Hypothesis, at: Start, sizes: Sequence[Start]) -> list[Start]:
    """The valleys among some sizes, all other unknowns following; `h` stands at `at`."""
    labels = h.unknowns.labels
    tried = [{n: x for n, x in size.items() if n in labels} for size in sizes]
    if not any(tried):
        return []
    along = [labels.index(n) for n in tried[0]]
    vectors = np.repeat(h.vector[None], len(tried), axis=0)
    vectors[:, along] = [list(one.values()) for one in tried]
    slopes = [whole(S) for S in h.slopes(h.vector)]
    batches = [followed(h, along, some, slopes) for some in batched(list(vectors), TOGETHER)]
    ends = [one for some in batches for one in some]
    return [{**at, **h.at(ends[k][1]).values()} for k in _valleys([cost for cost, _ in ends])]


def _places(
    data: Data, effects: Sequence[Effect], scanned: Sequence[str]
) -> list[dict[str, float]]:
    """The sizes that the screen tries: of all `scanned` parameters, by place in their grids."""
    arm = data.bare.with_effects(effects).arm
    effect_parameters = [
        k for one in effects for k in one.parameters(arm, data.bare.drive, data.sizes)
    ]
    grids = {
        k.parameter.name: sorted(k.grid)
        for k in effect_parameters
        if k.parameter.name in scanned and k.grid
    }
    places = range(max((len(grid) for grid in grids.values()), default=0))
    return [{n: g[min(i, len(g) - 1)] for n, g in grids.items()} for i in places]


def _closely(places: Sequence[Mapping[str, float]]) -> Iterator[dict[str, float]]:
    """The places, and between two of them so many that neighbours differ by CLOSER at most."""
    for a, b in pairwise(places):
        ratios = [b[n] / a[n] for n in a if a[n] * b[n] > 0.0]
        count = max((int(np.ceil(abs(np.log(x)) / np.log(CLOSER))) for x in ratios), default=1)
        for share in np.arange(count) / count:
            yield {
                n: float(a[n] * (b[n] / a[n]) ** share if a[n] * b[n] > 0.0 else a[n]) for n in a
            }
    yield from (dict(last) for last in places[-1:])


def _valleys(found: Sequence[float]) -> list[int]:
    """The places whose cost is below that of their neighbours, the best BEST of them."""
    edged = [np.inf, *found, np.inf]
    lowest = [k for k, x in enumerate(found) if edged[k] > x <= edged[k + 2]]
    return sorted(lowest, key=lambda k: found[k])[:BEST]


def _descended(
    data: Data,
    effects: Sequence[Effect],
    values: Mapping[str, float],
    most: int,
    stopped: Callable[[], bool],
    held: Collection[str] = (),
) -> tuple[float, Start]:
    """Cost per sample and values after at most so many iterations; sizes that are `held` stay."""
    h = _free(data, effects, values, held).coarse
    found = descend(h.errors, h.slopes, h.vector, h.limits, stopped, most=most)
    return found.cost / data.count, {**values, **h.at(found.vector).values()}


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
