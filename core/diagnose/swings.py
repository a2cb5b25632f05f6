"""Where a refit of something that swings begins: from the first swings of each recording.

A fit without a soft base or an elastic joint puts a beam's own vibration where the recordings swing
most. With the effect added that vibration belongs elsewhere, by a factor, and over whole recordings
its cost has a minimum wherever model and recording meet again after some more or fewer swings. Over
the first few swings there is one wide valley (core.identify.growing). So stiffness and size are
drawn together, compared over the beginnings, and the best descend while the recordings grow.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import qmc

from core.arm.symbols import Structure
from core.diagnose.data import Data, Hypothesis, hypothesis
from core.diagnose.descent import cost_of, descend
from core.effects.effect import Effect
from core.identify.growing import FEWEST, SHARES, beginnings

DRAWN = 64
"""Points; a sixteenth of each recording makes them as dear as four simulations of all."""

BENT = 3.0
"""Factor by which a missing effect bends a stiffness: soft joints drove EI to 0.31 of its value."""

BEST = 3
"""Of the points, that descend over the first swings."""

ITERATIONS = 4
"""Over each length of the recordings: the next one takes up where this one ends."""

SEED = 14
"""Of the points; a ranking must not change from one look to the next."""


def from_first_swings(
    data: Data,
    base: Hypothesis,
    effects: Sequence[Effect],
    values: Mapping[str, float],
    scanned: Sequence[str],
    stopped: Callable[[], bool],
) -> dict[str, float] | None:
    """A start of the model with `effects`, label -> value; None where the effects leave the arm's
    coordinates as they are, or where beginnings say too little."""
    model = data.bare.with_effects(effects, {**values}, data.sizes)
    if Structure.of(model.arm) == Structure.of(base.model.arm):
        return None
    whole = hypothesis(data, effects, values)
    looks = [b for b in (_begun(data, s) for s in SHARES) if b is not None]
    looks = [b for b in looks if b.count >= FEWEST * len(whole.vector)]
    if not looks:
        return None
    points = _drawn(data, whole, effects, values, scanned)
    costs = [np.inf if stopped() else _cost(looks[0], effects, one) for one in points]
    first = [points[i] for i in np.argsort(costs)[:BEST]]
    ended = [_descended(looks[0], effects, one, stopped) for one in first]
    best = min(ended, key=lambda one: one[0])[1]
    for look in looks[1:]:
        _, best = _descended(look, effects, best, stopped)
    return best


def _begun(data: Data, share: float) -> Data | None:
    """The same comparison over the first `share` of each recording."""
    parts = beginnings(data.experiments, share)
    return replace(data, experiments=tuple(parts), anchor=None) if parts else None


def _drawn(
    data: Data,
    h: Hypothesis,
    effects: Sequence[Effect],
    values: Mapping[str, float],
    scanned: Sequence[str],
) -> list[dict[str, float]]:
    """The start itself, and points spread over nominal values and sizes in their logarithm."""
    ranges = {**_nominal(data, h), **_sizes(data, effects, scanned)}
    if not ranges:
        return [dict(values)]
    drawn = qmc.LatinHypercube(len(ranges), rng=np.random.default_rng(SEED)).random(DRAWN)
    low, high = (np.log([r[i] for r in ranges.values()]) for i in (0, 1))
    points = np.exp(low + drawn * (high - low))
    return [dict(values), *({**values, **_named(ranges, one)} for one in points)]


def _named(names: Mapping[str, object], point: np.ndarray) -> dict[str, float]:
    return {name: float(x) for name, x in zip(names, point, strict=True)}


def _nominal(data: Data, h: Hypothesis) -> dict[str, tuple[float, float]]:
    """Positive parameters of the arm -> from where to where, around where they stand."""
    at, found = h.values(), dict[str, tuple[float, float]]()
    for u in data.nuisance:
        x = at.get(u.label, 0.0)
        if u.recording is None and u.searched and u.parameter.positive and x > 0.0:
            p = u.parameter
            found[u.label] = (max(x / BENT, p.lower, 1e-12 * x), min(x * BENT, p.upper))
    return found


def _sizes(
    data: Data, effects: Sequence[Effect], scanned: Sequence[str]
) -> dict[str, tuple[float, float]]:
    """Sizes without a slope at neutral -> the ends of the grid that the screen tries."""
    arm = data.bare.with_effects(effects).arm
    knobs = [k for one in effects for k in one.parameters(arm, data.bare.drive, data.sizes)]
    return {
        k.parameter.name: (min(k.grid), max(k.grid))
        for k in knobs
        if k.parameter.name in scanned and k.grid and min(k.grid) > 0.0
    }


def _cost(data: Data, effects: Sequence[Effect], values: Mapping[str, float]) -> float:
    h = hypothesis(data, effects, values).coarse
    return cost_of(h.errors(h.vector))


def _descended(
    data: Data, effects: Sequence[Effect], values: Mapping[str, float], stopped: Callable[[], bool]
) -> tuple[float, dict[str, float]]:
    """Cost per sample and values (label -> value) after some steps."""
    h = hypothesis(data, effects, values).coarse
    found = descend(h.errors, h.slopes, h.vector, h.limits, stopped, most=ITERATIONS)
    return found.cost / data.count, {**values, **h.at(found.vector).values()}
