"""What an enlarged model does not need, and what stands in it for something better.

An effect that was accepted while others were missing has the largest share of an error to which
several contribute, and what came after it is fitted around it. So in the end each is asked whether
it is needed at all, or the simpler ones that it includes instead, and whether another fits better
in its place, the others staying: all candidates linearly (from the last model's columns, without a
simulation each), the best by a refit. So is every pair: a wrong gain and a wrong mass together are
a motor's inertia.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ..diagnose.evidence import RELEVANT, TIE
from ..diagnose.fit_problem import Data, hypothesis, names_of
from ..diagnose.gram_matrix import gram
from ..diagnose.linear_screen import Screen
from ..diagnose.output_changes import Column
from ..diagnose.refit import Refit, fit, refit_with, settled, whitened
from ..diagnose.refit_starts import ROUGH_ITERATIONS
from ..diagnose.remaining_error import within_noise
from ..diagnose.shape_refinement import best_shape, own_shape
from ..diagnose.whitening import fit_whitener, whitened_rows
from ..effects import effect
from ..effects.effect import Effect
from ..identify import predictor

Stopped = Callable[[], bool]


class Revised(NamedTuple):
    """A fitted model with other effects."""

    refit: Refit
    effects: tuple[Effect, ...]


def without_needless(
    data: Data, refit: Refit, present: Sequence[Effect], given: int, stopped: Stopped
) -> Revised:
    """Takes out effects without which the error hardly grows, or stays within the noise, or puts
    the simpler ones that they include in their place; of several each time what leaves least.

    The last added too: an effect of no size can lead the others out of a minimum that they were
    stuck in. The first `given` are what the user put into the model: they stay.
    """
    now, most = Revised(refit, tuple(present)), refit.cost + RELEVANT * data.count
    while not stopped():
        options = [o for k in range(given, len(now.effects)) for o in _without(now.effects, k)]
        enough = [
            one
            for one in _refitted(data, now.refit, options, stopped)
            if (one.refit.cost < most or within_noise(data, one.refit.errors))
            and not _coarser_and_less_likely(data, one.refit, now.refit)
        ]
        if stopped() or not enough:
            break
        now = min(enough, key=lambda one: priced(one.refit, data))
    return now._replace(refit=settled(now.refit)) if now.effects != tuple(present) else now


def priced(found: Refit, data: Data) -> float:
    """Squared error, and the price of the parameters (BIC)."""
    return float(found.cost + len(found.hypothesis.unknowns) * np.log(data.count))


def _refitted(
    data: Data, refit: Refit, options: Sequence[tuple[Effect, ...]], stopped: Stopped
) -> list[Revised]:
    """Each set of effects fitted from where a model stands."""

    def tried(effects: tuple[Effect, ...]) -> Revised:
        start = hypothesis(data, effects, refit.hypothesis.values())
        return Revised(fit(start, None, stopped, ROUGH_ITERATIONS), effects)

    with ThreadPoolExecutor(predictor.WORKERS) as pool:
        return list(pool.map(tried, options))


def _without(effects: Sequence[Effect], place: int) -> Iterator[tuple[Effect, ...]]:
    """The effects with nothing in one's place, or with what it includes; none where others need
    it."""
    one, before, after = effects[place], effects[:place], effects[place + 1 :]
    if any(one.kind in e.includes for e in (*before, *after)):
        return
    for simpler in _simpler(effects, place):
        yield (*before, *simpler, *after)


def _simpler(effects: Sequence[Effect], place: int) -> list[tuple[Effect, ...]]:
    """What may be left of an effect: nothing, or the simpler ones that it includes. A soft base
    beside motors' inertia was an elastic joint, which has such motors."""
    have = {e.kind for e in effects}
    simpler = tuple(effect(kind) for kind in effects[place].includes if kind not in have)
    return [(), simpler] if simpler else [()]


def _coarser_and_less_likely(data: Data, found: Refit, refit: Refit) -> bool:
    """Whether a model has fewer bending shapes than another and the recordings are far less likely
    under it: shapes cost no parameter, so the evidence alone decides on them."""
    shapes, before = (
        sum(e.resolution for e in one.hypothesis.model.effects) for one in (found, refit)
    )
    if shapes == before:
        return False
    whitener = fit_whitener(refit.errors, whitened_rows(data.experiments))
    without, with_them = (whitened(r.hypothesis, r.descended, whitener)[0] for r in (found, refit))
    return without - with_them > TIE


TRIED = 2
"""Rivals of one effect, or of all pairs, that are refitted: the best by the share that straight
lines explain."""

SHARE = 0.5
"""Of what an effect explains, that a competitor must explain by straight lines to be refitted: the
refit moves the others too, and straight lines are right within a factor of two at most sizes."""


class _Exchange(NamedTuple):
    """The effects with one in the place of others, where to begin, and what a scan found."""

    effects: tuple[Effect, ...]
    values: dict[str, float]
    scanned: tuple[str, ...]
    share: float
    """Of what the replaced effects explain, that straight lines say it explains."""


def best_exchange(
    data: Data, refit: Refit, present: Sequence[Effect], given: int, seen: Screen, stopped: Stopped
) -> Revised | None:
    """The model with one accepted effect replaced, where that is better by more than a tie of BIC,
    or with one in the place of two, where that is better at all.

    Args:
        data: anchored at `refit`.
        present: the effects in the model; the first `given` are the user's and stay.
        seen: the screen of all candidates at `refit`.

    Returns:
        None where every effect is the best in its place.
    """
    white, _ = whitened(refit.hypothesis, refit.descended, seen.whitener)
    refit = replace(refit, white_cost=white)

    def refitted(one: _Exchange) -> Refit:
        start = {**refit.hypothesis.values(), **one.values}
        return refit_with(
            data, refit.hypothesis, one.effects, start, seen.whitener, seen.slopes,
            one.scanned, stopped,
        )  # fmt: skip

    tried = list(_exchanges(data, refit, present, given, seen))
    with ThreadPoolExecutor(predictor.WORKERS) as pool:
        refits = list(pool.map(refitted, tried))
    if stopped():
        return None
    before, best, least = _bic(refit, data), None, 0.0
    for one, found in zip(tried, refits, strict=True):
        gained = before - _bic(found, data) if np.isfinite(found.cost) else -np.inf
        enough = 0.0 if len(one.effects) < len(present) else TIE
        if gained > max(enough, least):
            best, least = Revised(found, one.effects), gained
    return best


def _exchanges(
    data: Data, refit: Refit, present: Sequence[Effect], given: int, seen: Screen
) -> Iterator[_Exchange]:
    ours = range(given, len(present))
    for k in ours:
        for simpler in _simpler(present, k):
            yield from _instead(data, refit, present, (k,), seen, simpler)[:TRIED]
    pairs = [x for ks in combinations(ours, 2) for x in _instead(data, refit, present, ks, seen)]
    yield from sorted(pairs, key=lambda x: -x.share)[:TRIED]


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
