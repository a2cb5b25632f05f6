"""Backward removal: an early step may have become needless through a later one."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from core.diagnose.data import Data, hypothesis
from core.diagnose.evidence import RELEVANT, TIE
from core.diagnose.refit import Refit, fit, settled, whitened
from core.diagnose.verdict import within_noise
from core.diagnose.whitening import fit_whitener, whitened_rows
from core.effects import effect
from core.effects.effect import Effect
from core.identify import predictor

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
    given: int,
    stopped: Callable[[], bool],
) -> tuple[Kept, tuple[Effect, ...]]:
    """Takes out effects without which the error hardly grows, or stays within the noise, or puts
    the simpler ones that they include in their place; of several each time what leaves least.

    The last added too: an effect of no size can lead the others out of a minimum that they were
    stuck in. The first `given` are what the user put into the model: they stay.
    """
    kept: list[tuple[Effect, ...]] = [(one,) for one in present]
    whole, removed = refit, dict[int, Effect]()
    while not stopped():
        options = [
            (place, [*kept[:place], instead, *kept[place + 1 :]])
            for place in range(given, len(present))
            if place not in removed
            for instead in _instead(kept, place)
        ]
        found = _needless(data, refit, whole, options, stopped)
        if found is None:
            break
        refit, place, kept = found
        removed[place] = present[place]
    refit = settled(refit) if removed else refit
    return Kept(refit, _flat(kept)), tuple(removed[place] for place in sorted(removed))


Option = tuple[int, list[tuple[Effect, ...]]]
"""A place, and what stands in all of them without its effect."""


def without_refuted(
    data: Data, refit: Refit, present: Sequence[Effect], given: int, kinds: Collection[str],
    stopped: Callable[[], bool],
) -> Kept:  # fmt: skip
    """Without the effects `kinds` but for the first `given`; what they include stays where the
    recordings call for it."""
    kept: list[tuple[Effect, ...]] = [(one,) for one in present]
    for place in range(given, len(present)):
        if present[place].kind not in kinds:
            continue
        tried = []
        for instead in _instead(kept, place):
            rest = [*kept[:place], instead, *kept[place + 1 :]]
            start = hypothesis(data, _flat(rest), refit.hypothesis.values())
            tried.append((fit(start, None, stopped, ITERATIONS), rest))
        if tried:
            refit, kept = min(tried, key=lambda one: priced(one[0], data))
    return Kept(settled(refit), _flat(kept))


def priced(found: Refit, data: Data) -> float:
    """Squared error, and the price of the parameters (BIC)."""
    return float(found.cost + len(found.hypothesis.unknowns) * np.log(data.count))


def _needless(
    data: Data,
    refit: Refit,
    whole: Refit,
    options: Sequence[Option],
    stopped: Callable[[], bool],
) -> tuple[Refit, int, list[tuple[Effect, ...]]] | None:
    """The option with the least squared error and price of its parameters, of those that leave
    hardly more than `whole`, or no more than noise."""

    def tried(one: Option) -> Refit:
        start = hypothesis(data, _flat(one[1]), refit.hypothesis.values())
        return fit(start, None, stopped, ITERATIONS)

    with ThreadPoolExecutor(predictor.WORKERS) as pool:
        fits = list(pool.map(tried, options))
    enough = [
        (priced(found, data), n)
        for n, found in enumerate(fits)
        if (found.cost - whole.cost < RELEVANT * data.count or within_noise(data, found.errors))
        and not _coarser_and_less_likely(data, found, refit)
    ]
    if stopped() or not enough:
        return None
    _, n = min(enough)
    return fits[n], *options[n]


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


def _flat(places: Sequence[tuple[Effect, ...]]) -> tuple[Effect, ...]:
    return tuple(one for place in places for one in place)


def _instead(kept: Sequence[tuple[Effect, ...]], place: int) -> list[tuple[Effect, ...]]:
    """What may stand in an effect's place: nothing, or what it includes; it stays where others
    need it."""
    (one,) = kept[place]
    others = _flat([*kept[:place], *kept[place + 1 :]])
    if any(one.kind in e.includes for e in others):
        return []
    have = {e.kind for e in others}
    simpler = tuple(effect(kind) for kind in one.includes if kind not in have)
    return [(), *([simpler] if simpler else [])]
