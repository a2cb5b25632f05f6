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
from ..diagnose.base_fit import substeps_for_directions
from ..diagnose.cost_minimum import converge
from ..diagnose.evidence import LEAST_SHARE, RELEVANT, TIE
from ..diagnose.fit_problem import (
    UNANCHORED_ERROR,
    Data,
    SubstepsByModes,
    enough_substeps,
    for_model,
    hypothesis,
)
from ..diagnose.fitted_model import FittedModel
from ..diagnose.linear_screen import screen
from ..diagnose.refit import with_whitened_cost
from ..diagnose.refit_starts import nominal_values
from ..diagnose.remaining_error import within_noise
from ..effects import effect
from ..identify.predictor import MotionCache
from ..least_squares import cost_of
from ..noise.whitening import fit_whitener, whitened_rows

StopCheck = Callable[[], bool]


def resolved(model: FittedModel, least: tuple[int, ...], stopped: StopCheck) -> FittedModel:
    """The model with as many bending shapes as the recordings show, at least so many per segment;
    the same object where these are right."""
    tried = {model.data.bare.arm.modes}
    while not stopped():
        others = _reshaped(model, least, tried, stopped)
        other = next((m for m in others if _is_better(model, m)), None)
        if other is None:
            return model
        model = other
    return model


def _reshaped(
    model: FittedModel, least: tuple[int, ...], tried: set[tuple[int, ...]], stopped: StopCheck
) -> Iterator[FittedModel]:
    """The model with one shape less and, where that is worth a fit, one more per bending segment;
    not those that have been `tried`."""
    modes = model.data.bare.arm.modes
    fewer = tuple(max(n - 1, low) for n, low in zip(modes, least, strict=True))
    more = tuple(min(n + 1, MAX_MODES) if n else 0 for n in modes)
    if fewer not in tried:
        tried.add(fewer)
        yield _with_modes(model, fewer, stopped)
    if more not in tried and _promises_more(model):
        tried.add(more)
        yield _with_modes(model, more, stopped)


def _promises_more(model: FittedModel) -> bool:
    """Whether one more shape is worth a fit: by the linear estimate of what it explains, with all
    other parameters free."""
    data, extra = replace(model.data, anchor=None), effect("extra_bending_mode")
    screened = screen(data, model.refit.hypothesis, model.effects, [extra])
    return any(_needed(model, s.score, s.cost_reduction) for s in screened.candidates)


def _needed(model: FittedModel, likelier: float, explained: float) -> bool:
    """Whether shapes that reduce the whitened squared error by `likelier`, and the squared error by
    `explained`, are needed: within the noise the evidence alone decides; an error above it must
    shrink as much as by an effect."""
    data, errors = model.data, model.refit.errors
    above = max(model.refit.cost - data.count, RELEVANT * data.count)
    return likelier > TIE and (within_noise(data, errors) or explained >= LEAST_SHARE * above)


def _with_modes(model: FittedModel, modes: tuple[int, ...], stopped: StopCheck) -> FittedModel:
    """The model with so many shapes, fitted from the current and from the nominal values."""
    data = data_with_modes(model.data, modes, model)
    at = {**model.refit.hypothesis.model.effect_values, **model.refit.hypothesis.values()}
    starts = [
        hypothesis(data, model.effects, {**at, **other}) for other in ({}, nominal_values(data))
    ]
    best = min(starts, key=lambda h: cost_of(h.errors(h.vector)))
    return FittedModel(*converge(data, best, None, stopped), model.effects)


def data_with_modes(data: Data, modes: tuple[int, ...], model: FittedModel) -> Data:
    """The same recordings for an arm with so many shapes per segment, in steps that are fine
    enough for the effects and values of a model."""
    bare = replace(data.bare, arm=arm_with_modes(data.bare.arm, modes))
    experiments = tuple(for_model(e, bare) for e in data.experiments)
    other = replace(
        data, bare=bare, experiments=experiments, anchor=None, motion_cache=MotionCache(),
        substeps_by_modes=SubstepsByModes(), result_substeps=None,
    )  # fmt: skip
    values = {**model.refit.hypothesis.model.effect_values, **model.refit.hypothesis.values()}
    steps = enough_substeps(other, model.effects, values, UNANCHORED_ERROR)
    steps = substeps_for_directions(other, model.effects, values, steps)
    return replace(other, substeps=steps, anchored_substeps=steps)


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
    return _needed(model, likelier, before.cost - after.cost)
