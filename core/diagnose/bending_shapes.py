"""How many bending shapes the model of each beam needs: a question of resolution.

A beam has infinitely many shapes; a model has as many as the recordings can show. One more costs no
parameter, so the evidence alone decides. A soft beam with too few may leave only noise although its
stiffness is wrong by a third.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from ..arm.arm import Arm
from ..arm.segment import MAX_MODES
from ..diagnose.evidence import TIE
from ..diagnose.gram_matrix import explained_by, gram_matrix
from ..diagnose.linear_screen import remainders_of
from ..estimate.fit_result import COMPARED_SUBSTEPS, fit, with_whitened_cost
from ..estimate.fitted_model import FittedModel
from ..estimate.minimum import RELEVANT, converge, with_enough_substeps
from ..estimate.problem import FitData, problem_of
from ..estimate.starts import ROUGH_ITERATIONS, nominal_values
from ..least_squares import cost_of
from ..noise.whitening import fit_whitener, no_whitening, whitened_rows
from ..results import ABOVE

StopCheck = Callable[[], bool]

FitsByShapes = dict[tuple[tuple[int, ...], tuple[str, ...]], FittedModel | None]
"""Bending shapes per segment and kinds of the effects -> the fit; None where its error stays
larger."""


def resolved(
    model: FittedModel, least: tuple[int, ...], stopped: StopCheck, known: FitsByShapes
) -> FittedModel:
    """The model with as many bending shapes as the recordings show, at least so many per segment;
    the same object where these are right. `known` fits, to which new ones are added, are seen
    against the noise of the model and cost no simulation."""
    tried = {model.data.bare.arm.modes}
    while not stopped():
        others = _reshaped(model, least, tried, stopped, known)
        other = next((m for m in others if m and _is_better(model, m)), None)
        if other is None:
            return model
        model = other
    return model


def _reshaped(
    model: FittedModel, least: tuple[int, ...], tried: set[tuple[int, ...]], stopped: StopCheck,
    known: FitsByShapes,
) -> Iterator[FittedModel | None]:  # fmt: skip
    """The model with one shape less and, where that is worth a fit, one more per bending segment;
    not those that have been `tried`."""
    modes = model.data.bare.arm.modes
    fewer = tuple(max(n - 1, low) for n, low in zip(modes, least, strict=True))
    more = tuple(min(n + 1, MAX_MODES) if n else 0 for n in modes)
    for shapes in (fewer, more):
        if shapes in tried:
            continue
        tried.add(shapes)
        key = shapes, tuple(sorted(e.kind for e in model.effects))
        if key not in known:
            data = data_with_modes(model.data, shapes, model)
            if shapes == more and not _promises_more(model, data):
                continue
            known[key] = _with_shapes(data, model, stopped)
        other = known[key]
        yield None if other is None else other.against(model.data)


def _promises_more(model: FittedModel, data: FitData) -> bool:
    """Whether the shapes of `data` are worth a fit: by the linear estimate of what they explain,
    with all other parameters free."""
    at = model.refit.problem
    problem = problem_of(data, model.effects, at.all_values())
    residual, slopes = list(model.refit.errors), list(model.refit.descended.slopes)
    change = [[a - b for a, b in zip(residual, problem.errors(problem.vector), strict=True)]]
    prior = at.limits.prior_measurements(at.vector)
    plain = gram_matrix(residual, slopes, change, no_whitening, prior)
    remainders = remainders_of(plain, residual, slopes, change)
    whitener = fit_whitener(remainders, whitened_rows(data.experiments))
    projected = gram_matrix(residual, slopes, change, whitener, prior).projected()
    return _needed(model, explained_by(projected, [0], [True]).cost_reduction)


def _needed(model: FittedModel, likelier: float) -> bool:
    """Whether shapes that reduce the whitened squared error by `likelier` are needed: more than a
    tie, and by a relevant amount where the error is well above the noise."""
    count = model.data.count
    above = model.refit.cost > ABOVE**2 * count
    return likelier > (max(TIE, RELEVANT * count) if above else TIE)


def _with_shapes(data: FitData, model: FittedModel, stopped: StopCheck) -> FittedModel | None:
    """The model with the shapes of `data`, fitted from the current and from the nominal values;
    None where its error stays larger."""
    at = model.refit.problem.all_values()
    starts = [
        problem_of(data, model.effects, {**at, **other}) for other in ({}, nominal_values(data))
    ]
    best = min(starts, key=lambda problem: cost_of(problem.errors(problem.vector)))
    first = fit(best, None, stopped, ROUGH_ITERATIONS)
    if first.cost > model.refit.cost + RELEVANT * data.count:
        return None
    return FittedModel(*converge(data, first.problem, None, stopped), model.effects)


def data_with_modes(data: FitData, modes: tuple[int, ...], model: FittedModel) -> FitData:
    """The same recordings for an arm with so many shapes per segment, in steps that are fine
    enough for the effects and values of a model."""
    other = data.for_bare(replace(data.bare, arm=arm_with_modes(data.bare.arm, modes)))
    # No anchor corrects them, so they take the steps of errors that are compared.
    values = model.refit.problem.all_values()
    return with_enough_substeps(other, model.effects, values, COMPARED_SUBSTEPS)


def arm_with_modes(arm: Arm, modes: tuple[int, ...]) -> Arm:
    """The arm with so many bending shapes per segment."""
    pairs = zip(arm.segments, modes, strict=True)
    segments = tuple(s.model_copy(update={"modes": n}) for s, n in pairs)
    return arm.model_copy(update={"segments": segments})


def _is_better(model: FittedModel, other: FittedModel) -> bool:
    """Whether more shapes are needed; with fewer, whether the recordings are hardly less likely."""
    data = model.data
    least = min(model, other, key=lambda m: m.refit.cost)
    noise = fit_whitener(least.refit.errors, whitened_rows(data.experiments))
    before, after = (with_whitened_cost(m.refit, noise) for m in (model, other))
    likelier = before.whitened_cost - after.whitened_cost
    if sum(other.data.bare.arm.modes) < sum(data.bare.arm.modes):
        return likelier > -TIE
    return _needed(model, likelier)
