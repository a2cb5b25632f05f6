"""Removal of needless effects, and exchange of effects for better ones.

An effect that was accepted while others were missing explains part of their error, and later
effects are fitted around it. So each effect is tested at the end: is it needed, do the simpler
effects that it includes suffice, does another one fit better in its place? Candidates are compared
by the linear screen of the last model; the best are refitted. Pairs are tested too: a wrong gain
and a wrong mass together are a motor's inertia.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ..arm.catalogue import arm_parameters
from ..diagnose.evidence import LEAST_SHARE, TIE
from ..diagnose.force_shape_refinement import best_force_shape, joint_force_shape
from ..diagnose.gram_matrix import gram_matrix
from ..diagnose.linear_screen import Screen, screen
from ..diagnose.output_changes import OutputChange
from ..effects import effect, with_included
from ..effects.effect import Effect
from ..effects.sizes import Sizes
from ..estimate.fit_result import (
    FitResult,
    fit,
    refit_with,
    with_robust_covariance,
    with_whitened_cost,
)
from ..estimate.fitted_model import FittedModel, fit_model
from ..estimate.minimum import RELEVANT
from ..estimate.problem import FitData, problem_of, with_shared_motions, within_noise
from ..estimate.starts import ROUGH_ITERATIONS
from ..model import Model
from ..processors import thread_pool

StopCheck = Callable[[], bool]


class RevisedModel(NamedTuple):
    """A fitted model with revised effects."""

    refit: FitResult
    effects: tuple[Effect, ...]


def needed_effects(
    data: FitData,
    refit: FitResult,
    present: Sequence[Effect],
    stated_count: int,
    stopped: StopCheck,
) -> RevisedModel:
    """Remove effects without which the error hardly grows or stays within noise, or replace them
    by the simpler ones that they include; each time the option with the best BIC.

    The last effect may go, too: without size it can still have brought the others to a better
    minimum.
    The first `stated_count` effects are the user's and stay.
    """
    model, most = RevisedModel(refit, tuple(present)), refit.cost + RELEVANT * data.count
    while not stopped():
        options = [
            o
            for k in range(stated_count, len(model.effects))
            for o in _reduced_sets(model.effects, k)
        ]
        acceptable = [
            option
            for option in _refitted(data, model.refit, options, stopped)
            if option.refit.cost < most or within_noise(data, option.refit.errors)
        ]
        if stopped() or not acceptable:
            break
        model = min(acceptable, key=lambda option: bic(option.refit, data))
    if model.effects == tuple(present):
        return model
    return model._replace(refit=with_robust_covariance(model.refit))


def with_stated_sizes(model: FittedModel, stated_count: int, stopped: StopCheck) -> FittedModel:
    """The model with what its added effects free beside their own sizes, such as the motors'
    inertias of an elastic joint, as stated; as it is where that leaves relevantly more."""
    data, values = model.data, model.refit.problem.values()
    own = [
        k
        for e in model.effects[stated_count:]
        for k in e.parameters(e.changed_arm(data.bare.arm, {}), data.bare.drive, data.sizes)
    ]
    sizes = {k.parameter.name for k in own if not k.secondary}
    stated = arm_parameters(data.bare.arm).keys() & values.keys() - sizes
    fixed = {k.parameter.name: k.neutral for k in own if k.parameter.name in stated}
    if not fixed or stopped():
        return model
    held = replace(data, fixed_effect_values={**data.fixed_effect_values, **fixed})
    after = fit_model(held, model.effects, {**values, **fixed}, stopped)
    return after if after.refit.cost - model.refit.cost < RELEVANT * data.count else model


def bic(refit: FitResult, data: FitData) -> float:
    """Squared error in noise floors plus the price of the parameters (Schwarz 1978)."""
    return float(refit.cost + len(refit.problem.unknowns) * np.log(data.count))


def _refitted(
    data: FitData, refit: FitResult, options: Sequence[tuple[Effect, ...]], stopped: StopCheck
) -> list[RevisedModel]:
    """Each set of effects, fitted from a model's current values."""

    def fitted(effects: tuple[Effect, ...]) -> RevisedModel:
        start = problem_of(data, effects, refit.problem.values())
        return RevisedModel(fit(start, None, stopped, ROUGH_ITERATIONS), effects)

    with thread_pool(len(options)) as pool:
        return list(pool.map(fitted, options))


def _reduced_sets(effects: Sequence[Effect], place: int) -> Iterator[tuple[Effect, ...]]:
    """Sets of effects without one of them, or with what it includes; none if others need it."""
    omitted, before, after = effects[place], effects[:place], effects[place + 1 :]
    if any(omitted.kind in e.includes for e in (*before, *after)):
        return
    for simpler in _simpler_replacements(effects, place):
        yield (*before, *simpler, *after)


def _simpler_replacements(effects: Sequence[Effect], place: int) -> list[tuple[Effect, ...]]:
    """What may replace an effect: nothing, or the simpler ones that it includes. A soft base beside
    motor inertia was an elastic joint, which has such motors."""
    have = {e.kind for e in effects}
    simpler = tuple(effect(kind) for kind in effects[place].includes if kind not in have)
    return [(), simpler] if simpler else [()]


TRIED = 2
"""Replacements of one effect, or of all pairs, that are refitted: the best by predicted share."""


class _Exchange(NamedTuple):
    """Effects with one in the place of others, start values, and scanned parameters."""

    effects: tuple[Effect, ...]
    values: dict[str, float]
    scanned: tuple[str, ...]
    share: float
    """Predicted share of what the replaced effects explain."""


def best_exchange(
    model: FittedModel, stated_count: int, candidates: Sequence[Effect], known: Screen | None,
    stopped: StopCheck,
) -> RevisedModel | None:  # fmt: skip
    """The model with one added effect replaced, if that is better by more than a tie of BIC; or
    with one effect in place of two, if that is better at all; None where every effect is the best
    in its place. `known`: the screen of the candidates on this model, if there is one. The first
    `stated_count` of its effects are the user's and stay."""
    data = with_shared_motions(model.data, model.refit.problem)
    present, problem = model.effects, model.refit.problem
    screened = known or screen(data, problem, present, candidates, lambda _: stopped())
    refit = with_whitened_cost(model.refit, screened.whitener)

    def refitted(exchange: _Exchange) -> FitResult:
        start = {**refit.problem.values(), **exchange.values}
        return refit_with(
            data, refit.problem, exchange.effects, start, screened.whitener, screened.slopes,
            exchange.scanned, stopped,
        )  # fmt: skip

    exchanges = list(_exchanges(data, refit, present, stated_count, screened))
    with thread_pool(len(exchanges)) as pool:
        refits = list(pool.map(refitted, exchanges))
    if stopped():
        return None
    before, best, best_gain = _whitened_bic(refit, data), None, 0.0
    for exchange, candidate in zip(exchanges, refits, strict=True):
        gained = before - _whitened_bic(candidate, data) if np.isfinite(candidate.cost) else -np.inf
        least_gain = 0.0 if len(exchange.effects) < len(present) else TIE
        if gained > max(least_gain, best_gain):
            best, best_gain = RevisedModel(candidate, exchange.effects), gained
    return best


def _exchanges(
    data: FitData, refit: FitResult, present: Sequence[Effect], stated_count: int, screened: Screen
) -> Iterator[_Exchange]:
    added = range(stated_count, len(present))
    for k in added:
        for simpler in _simpler_replacements(present, k):
            yield from _replacements(data, refit, present, (k,), screened, simpler)[:TRIED]
    pairs = [
        x
        for ks in combinations(added, 2)
        for x in _replacements(data, refit, present, ks, screened)
    ]
    yield from sorted(pairs, key=lambda x: -x.share)[:TRIED]


def _replacements(
    data: FitData, refit: FitResult, present: Sequence[Effect], places: Sequence[int],
    screened: Screen, simpler: Sequence[Effect] = (),
) -> list[_Exchange]:  # fmt: skip
    """Replacements of the effects at some places, most likely first; `simpler` effects stay beside
    them."""
    removed = [present[k] for k in places]
    kept = [e for k, e in enumerate(present) if k not in places]
    if any(r.kind in e.includes for r in removed for e in kept):
        return []
    at = min(places)
    kept[at:at] = simpler
    at += len(simpler)
    return [
        _Exchange((*kept[:at], competitor, *kept[at:]), values, scanned, share)
        for share, competitor, values, scanned in _best_competitors(
            data, refit, removed, kept, screened
        )
    ]


def _whitened_bic(refit: FitResult, data: FitData) -> float:
    return refit.whitened_cost + len(refit.problem.unknowns) * float(np.log(data.count))


def _best_competitors(
    data: FitData,
    refit: FitResult,
    removed: Sequence[Effect],
    others: Sequence[Effect],
    screened: Screen,
) -> list[tuple[float, Effect, dict[str, float], tuple[str, ...]]]:
    """(share, effect, start values, scanned parameters) of the effects that explain most of the
    error left without the effects `removed`, each as it explains it better: in a simulation without
    them, or along the slopes of this model. In the simulation vibrations are out of step where a
    large effect has gone, and nothing seems to replace it; a slope does not know where dry friction
    turns round."""
    problem = refit.problem
    neutral = _neutral_sizes(removed, problem.model, data.sizes)
    own = neutral.keys() - _neutral_sizes(others, problem.model, data.sizes).keys()
    labels = problem.unknowns.labels
    sizes = [(j, problem.vector[j] - neutral[name]) for j, name in enumerate(labels) if name in own]
    columns = [j for j, name in enumerate(labels) if name not in own]
    along = [
        e - sum(S[:, :, j] * size for j, size in sizes)
        for e, S in zip(refit.errors, screened.slopes, strict=True)
    ]
    without = problem_of(data, others, problem.values())
    simulated = [np.asarray(e) for e in without.errors(without.vector)]
    best: dict[str, tuple[float, Effect, dict[str, float], tuple[str, ...]]] = {}
    for errors in (simulated, along):
        if not all(np.all(np.isfinite(e)) for e in errors):
            continue
        for competitor in _competitors(refit, removed, screened, errors, columns):
            kind = competitor[1].kind
            if kind not in best or competitor[0] > best[kind][0]:
                best[kind] = competitor
    return sorted(best.values(), key=lambda f: -f[0])


def _competitors(
    refit: FitResult,
    removed: Sequence[Effect],
    screened: Screen,
    errors: Sequence[np.ndarray],
    columns: Sequence[int],
) -> Iterator[tuple[float, Effect, dict[str, float], tuple[str, ...]]]:
    """The same of the errors (M, k) per recording without the effects `removed`, to which the
    unknowns in `columns` adapt."""
    problem = refit.problem
    slopes = [S[:, :, list(columns)] for S in screened.slopes]
    blocks = [c.blocks for c in screened.output_changes]
    known = [x[list(columns)] for x in problem.limits.prior_measurements(problem.vector)]
    prior = known[0], known[1]
    products = gram_matrix(errors, slopes, blocks, screened.whitener, prior).projected()
    explained = products[-1, -1] - refit.whitened_cost
    for s in screened.candidates:
        if any(e.kind in s.effect.includes or s.effect.kind in e.includes for e in removed):
            continue  # an effect and its part are compared by the fit of their sizes
        shaped = best_force_shape(s.effect, screened.output_changes, products)
        if shaped.explained.cost_reduction > LEAST_SHARE * explained:
            chosen = [screened.output_changes[i] for i in shaped.chosen]
            values = _start(chosen, shaped.explained.coefficients)
            scanned = tuple(c.parameter for c in chosen if c.scanned)
            share = shaped.explained.cost_reduction / max(explained, 1e-300)
            yield share, s.effect, values, scanned


def _neutral_sizes(effects: Sequence[Effect], model: Model, sizes: Sizes) -> dict[str, float]:
    """The sizes of effects, and of those that they include, with which they are not there."""
    each = (part.parameters(model.arm, model.drive, sizes) for part in with_included(effects))
    return {k.parameter.name: k.neutral for own in each for k in own}


def _start(chosen: Sequence[OutputChange], coefficients: np.ndarray) -> dict[str, float]:
    """Start values: neutral plus coefficient times size; scanned sizes unchanged."""
    values: dict[str, float] = {}
    for c, coefficient in zip(chosen, coefficients, strict=True):
        values |= joint_force_shape(c)
        share = 1.0 if c.scanned else float(coefficient)
        values |= {n: c.values[n] - (1.0 - share) * size for n, size in c.sizes.items()}
    return values
