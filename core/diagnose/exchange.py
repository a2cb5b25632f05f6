"""Exchange: an effect that was accepted while others were missing may have stood in for another.

What comes first has the largest share of an error to which several effects contribute, and the
ones after it are fitted around it; within the floor nobody asks again. So in the end every accepted
effect is compared with what could stand in its place, the others staying: all candidates linearly
(from the last model's columns, without a simulation each), the best of them by a refit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from core.diagnose.columns import Column
from core.diagnose.data import Data, hypothesis, names_of
from core.diagnose.evidence import TIE
from core.diagnose.gram import gram
from core.diagnose.refit import Refit, refit_with, whitened
from core.diagnose.screen import Screen
from core.diagnose.shapes import best_shape, own_shape
from core.effects.effect import Effect
from core.identify import predictor

TRIED = 2
"""Rivals of one effect that are refitted: the best by what they leave of it."""

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
    """The model with one accepted effect replaced, where that is better by more than a tie of BIC.

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
    before, best, least = _bic(refit, data), None, TIE
    for one, found in zip(tried, refits, strict=True):
        if found is not None and np.isfinite(found.cost) and before - _bic(found, data) > least:
            best, least = (found, one.effects), before - _bic(found, data)
    return best


class _Exchange(NamedTuple):
    """The effects with one replaced, where to begin, and what a scan found."""

    effects: tuple[Effect, ...]
    values: dict[str, float]
    scanned: tuple[str, ...]


def _exchanges(
    data: Data, refit: Refit, present: Sequence[Effect], given: int, seen: Screen
) -> list[_Exchange]:
    found = []
    for place in range(given, len(present)):
        rest = [*present[:place], *present[place + 1 :]]
        if any(present[place].kind in e.includes for e in rest):
            continue
        for competitor, values, scanned in _competitors(data, refit, present[place], rest, seen):
            effects = (*present[:place], competitor, *present[place + 1 :])
            found.append(_Exchange(effects, values, scanned))
    return found


def _bic(refit: Refit, data: Data) -> float:
    return refit.white_cost + len(refit.hypothesis.unknowns) * float(np.log(data.count))


def _competitors(
    data: Data, refit: Refit, one: Effect, rest: Sequence[Effect], seen: Screen
) -> list[tuple[Effect, dict[str, float], tuple[str, ...]]]:
    """What explains most of the error without `one`, where to begin, and what was scanned."""
    h = refit.hypothesis
    without = hypothesis(data, rest, h.values())
    errors = [np.asarray(e) for e in without.errors(without.vector)]
    if not all(np.all(np.isfinite(e)) for e in errors):
        return []
    own = set(names_of(one, h.model, data.sizes)) - {
        n for e in rest for n in names_of(e, h.model, data.sizes)
    }
    kept = [j for j, label in enumerate(h.unknowns.labels) if label not in own]
    slopes = [S[:, :, kept] for S in seen.slopes]
    blocks = [c.blocks for c in seen.columns]
    products = gram(errors, slopes, blocks, seen.whitener).projected()
    explained = products[-1, -1] - refit.white_cost
    found = []
    for s in seen.candidates:
        if one.kind in s.effect.includes or s.effect.kind in one.includes:
            continue
        mine = [i for i, c in enumerate(seen.columns) if c.effect is s.effect]
        shaped = best_shape(mine, seen.columns, products)
        if shaped.explained.drop > SHARE * explained:
            chosen = [seen.columns[i] for i in shaped.chosen]
            values = _start(chosen, shaped.explained.coefficients)
            scanned = tuple(c.parameter for c in chosen if c.scanned and c.parameter)
            found.append((shaped.explained.drop, s.effect, values, scanned))
    found.sort(key=lambda f: -f[0])
    return [f[1:] for f in found[:TRIED]]


def _start(chosen: Sequence[Column], coefficients: np.ndarray) -> dict[str, float]:
    """Neutral plus coefficient times size; a scanned size as it is."""
    values: dict[str, float] = {}
    for c, coefficient in zip(chosen, coefficients, strict=True):
        values |= own_shape(c)
        share = 1.0 if c.scanned else float(coefficient)
        values |= {n: c.values[n] - (1.0 - share) * size for n, size in c.sizes.items() if n}
    return values
