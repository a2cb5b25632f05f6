"""Exchange: an effect that was accepted while others were missing may have stood in for another.

What comes first has the largest share of an error to which several effects contribute, and the
ones after it are fitted around it; within the floor nobody asks again. So in the end every accepted
effect is compared with what could stand in its place, the others staying: all candidates linearly
(from the last model's columns, without a simulation each), the best of them by a refit. So is every
pair of them: a wrong gain and a wrong mass together are a motor's inertia.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from core.diagnose.columns import Column
from core.diagnose.data import Data, hypothesis, names_of
from core.diagnose.evidence import TIE
from core.diagnose.gram import gram
from core.diagnose.refit import Refit, refit_with, whitened
from core.diagnose.screen import Screen
from core.diagnose.shapes import best_shape, own_shape
from core.effects import effect
from core.effects.effect import Effect
from core.identify import predictor

TRIED = 2
"""Rivals of one effect that are refitted: the best by what they leave of it."""

PAIRS_TRIED = 2
"""Of all pairs of effects with one in their place, that are refitted: the best by the share that
straight lines explain."""

SHARE = 0.5
"""Of what an effect explains, that a competitor must explain by straight lines to be refitted: the
refit moves the others too, and straight lines are right within a factor of two at most sizes."""


def best_exchange(
    data: Data,
    refit: Refit,
    present: Sequence[Effect],
    given: int,
    seen: Screen,
    stopped: Callable[[], bool],
) -> tuple[Refit, tuple[Effect, ...]] | None:
    """The model with one accepted effect replaced, where that is better by more than a tie of BIC,
    or with one in the place of two, where that is better at all.

    Args:
        data: anchored at `refit`.
        present: the effects in the model; the first `given` are the user's and stay.
        seen: the screen of all candidates at `refit`.

    Returns:
        The refit and its effects; None where every effect is the best in its place.
    """
    white, _ = whitened(refit.hypothesis, refit.descended, seen.whitener)
    refit = replace(refit, white_cost=white)

    def refitted(one: _Exchange) -> Refit | None:
        if stopped():
            return None
        start = {**refit.hypothesis.values(), **one.values}
        return refit_with(
            data, refit.hypothesis, one.effects, start, seen.whitener, seen.slopes,
            one.scanned, stopped,
        )  # fmt: skip

    tried = _exchanges(data, refit, present, given, seen)
    with ThreadPoolExecutor(predictor.WORKERS) as pool:
        refits = list(pool.map(refitted, tried))
    if stopped():
        return None
    before, best, least = _bic(refit, data), None, 0.0
    for one, found in zip(tried, refits, strict=True):
        if found is None or not np.isfinite(found.cost):
            continue
        gained = before - _bic(found, data)
        enough = 0.0 if len(one.effects) < len(present) else TIE
        if gained > max(enough, least):
            best, least = (found, one.effects), gained
    return best


class _Exchange(NamedTuple):
    """The effects with one replaced, where to begin, and what a scan found."""

    effects: tuple[Effect, ...]
    values: dict[str, float]
    scanned: tuple[str, ...]
    share: float
    """Of what the replaced effects explain, that straight lines say it explains."""


def _exchanges(
    data: Data, refit: Refit, present: Sequence[Effect], given: int, seen: Screen
) -> list[_Exchange]:
    ours = range(given, len(present))
    ones = [
        x
        for k in ours
        for simpler in _simpler(present, k)
        for x in _instead(data, refit, present, (k,), seen, simpler)[:TRIED]
    ]
    twos = [x for ks in combinations(ours, 2) for x in _instead(data, refit, present, ks, seen)]
    return [*ones, *sorted(twos, key=lambda x: -x.share)[:PAIRS_TRIED]]


def _simpler(present: Sequence[Effect], place: int) -> list[tuple[Effect, ...]]:
    """What may be left of an effect beside its competitor: nothing, or the simpler ones that it
    includes. A soft base beside motors' inertia was an elastic joint, which has such motors."""
    have = {e.kind for e in present}
    simpler = tuple(effect(kind) for kind in present[place].includes if kind not in have)
    return [(), simpler] if simpler else [()]


def _instead(
    data: Data,
    refit: Refit,
    present: Sequence[Effect],
    places: Sequence[int],
    seen: Screen,
    simpler: Sequence[Effect] = (),
) -> list[_Exchange]:
    """What could stand in some places of the model together, the most likely first; beside what is
    left of them, the `simpler` ones."""
    gone = [present[k] for k in places]
    rest = [e for k, e in enumerate(present) if k not in places]
    if any(one.kind in e.includes for one in gone for e in rest):
        return []
    at = min(places)
    rest[at:at] = simpler
    at += len(simpler)
    return [
        _Exchange((*rest[:at], competitor, *rest[at:]), values, scanned, share)
        for share, competitor, values, scanned in _competitors(data, refit, gone, rest, seen)
    ]


def _bic(refit: Refit, data: Data) -> float:
    return refit.white_cost + len(refit.hypothesis.unknowns) * float(np.log(data.count))


def _competitors(
    data: Data, refit: Refit, gone: Sequence[Effect], rest: Sequence[Effect], seen: Screen
) -> list[tuple[float, Effect, dict[str, float], tuple[str, ...]]]:
    """What explains most of the error without the effects `gone`: the share that is explained, the
    effect, where to begin, and what was scanned."""
    h = refit.hypothesis
    without = hypothesis(data, rest, h.values())
    errors = [np.asarray(e) for e in without.errors(without.vector)]
    if not all(np.all(np.isfinite(e)) for e in errors):
        return []
    own = {n for e in gone for n in names_of(e, h.model, data.sizes)} - {
        n for e in rest for n in names_of(e, h.model, data.sizes)
    }
    kept = [j for j, label in enumerate(h.unknowns.labels) if label not in own]
    slopes = [S[:, :, kept] for S in seen.slopes]
    blocks = [c.blocks for c in seen.columns]
    products = gram(errors, slopes, blocks, seen.whitener).projected()
    explained = products[-1, -1] - refit.white_cost
    found = []
    for s in seen.candidates:
        if any(e.kind in s.effect.includes or s.effect.kind in e.includes for e in gone):
            continue  # an effect and its part are weighed by the fit of their sizes
        mine = [i for i, c in enumerate(seen.columns) if c.effect is s.effect]
        shaped = best_shape(mine, seen.columns, products)
        if shaped.explained.drop > SHARE * explained:
            chosen = [seen.columns[i] for i in shaped.chosen]
            values = _start(chosen, shaped.explained.coefficients)
            scanned = tuple(c.parameter for c in chosen if c.scanned and c.parameter)
            share = shaped.explained.drop / max(explained, 1e-300)
            found.append((share, s.effect, values, scanned))
    return sorted(found, key=lambda f: -f[0])


def _start(chosen: Sequence[Column], coefficients: np.ndarray) -> dict[str, float]:
    """Neutral plus coefficient times size; a scanned size as it is."""
    values: dict[str, float] = {}
    for c, coefficient in zip(chosen, coefficients, strict=True):
        values |= own_shape(c)
        share = 1.0 if c.scanned else float(coefficient)
        values |= {n: c.values[n] - (1.0 - share) * size for n, size in c.sizes.items() if n}
    return values
