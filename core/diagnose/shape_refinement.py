"""A second look at the shape of an effect, joint by joint, once its sizes are known.

The screen chooses shapes from straight lines through the bare model. Where one joint's part is
large, what it leaves beside its line hides the shape of the other; and a force that is a wave over
the position has hundreds of orders that fit nearly alike, for working points some distance apart
share a wave of any order that puts whole waves between them. So each joint's part is taken out in
turn, the torque that is then missing is asked which shape it has along the motion (there a force
law is linear in its sizes, exactly), and the best of these shapes race.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from core.diagnose.data import Data, Hypothesis, again, hypothesis
from core.diagnose.missing_torque import Pushed, pushed
from core.diagnose.refit import Refit, fit
from core.diagnose.shapes import place
from core.diagnose.torque_shape import Sized, best_shapes
from core.effects.effect import Effect, EffectParameter
from core.identify.prepared import Processing, prepare

Stopped = Callable[[], bool]

RACED = 4
"""Shapes from which a descent starts."""

ITERATIONS = 6
"""Of each descent: enough to know which leaves less."""


def refine_shape(data: Data, found: Refit, effect: Effect, stopped: Stopped) -> Refit:
    """The same model from the best shape at each joint, where that leaves less."""
    model, best = found.hypothesis.model, found
    effect_parameters = effect.parameters(model.arm, model.drive, data.sizes)
    for shape in [
        k for k in effect_parameters if k.secondary and k.finely and place(k.parameter.name)
    ]:
        at = place(shape.parameter.name)
        sizes = [k for k in effect_parameters if not k.secondary and place(k.parameter.name) == at]
        for start in _starts(data, best.hypothesis, effect, sizes, shape):
            if not stopped():
                tried = fit(start, None, stopped, most=ITERATIONS)
                best = tried if tried.cost < best.cost else best
    return best


NOISE = 4096
"""Samples of white noise that tell what filters leave of it, to a few per cent."""


def _unfiltered(data: Data) -> Data:
    """The same recordings without what happens to measurement and model alike before they are
    compared: one linear model tells how an output answers a torque, not what is left of it.

    The noise floors grow as those of white noise.
    """
    noise = np.random.default_rng(0).standard_normal((NOISE, 1))
    left = [
        np.array([np.std(e.processing.apply(noise, e.recording.sample_time, [k])) for k in e.kinds])
        for e in data.experiments
    ]
    return replace(
        data,
        experiments=tuple(
            prepare(e.model, e.recording, e.outputs, Processing()) for e in data.experiments
        ),
        weights=tuple(w * share for w, share in zip(data.weights, left, strict=True)),
        anchor=None,
    )


def _starts(
    data: Data,
    h: Hypothesis,
    effect: Effect,
    sizes: Sequence[EffectParameter],
    shape: EffectParameter,
) -> list[Hypothesis]:
    without = _without(data, h, sizes, shape)
    motions = _pushed(without, data)
    if not motions:
        return []
    tried = Sized(effect, h.model, {**h.model.effect_values, **h.values()}, tuple(sizes), shape)
    return [again(data, h, values, finer=1) for values in best_shapes(tried, motions, RACED)]


def _without(
    data: Data, h: Hypothesis, sizes: Sequence[EffectParameter], shape: EffectParameter
) -> Hypothesis:
    """The model with the sizes at neutral; these and their shape are no unknowns."""
    held = {k.parameter.name for k in (*sizes, shape)}
    neutral = {k.parameter.name: k.neutral for k in sizes}
    free = set(h.model.effect_parameters) - held
    own = [u for u in h.unknowns.items if u.parameter.name in free]
    values = {**h.model.effect_values, **h.values(), **neutral}
    return hypothesis(data, h.model.effects, values, freed=own, finer=1)


def _pushed(h: Hypothesis, data: Data) -> list[Pushed]:
    """Of each recording that tells its missing torque."""
    found: list[Pushed] = []
    if not all(e.processing.nothing for e in data.experiments):
        data = _unfiltered(data)
        h = again(data, h, finer=1)
    errors, agility = h.errors(h.vector), None
    for i, block in enumerate(errors):
        one, agility = pushed(h, i, block / data.weights[i], 1.0 / data.weights[i], agility)
        found += [] if one is None else [one]
    return found
