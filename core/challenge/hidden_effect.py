"""Hidden effects of a chosen size (core.challenge.detectability).

Each joint or segment has a random share of the size, and a random sign if signs are free.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..challenge.challenge_rig import bare_model, challenge_rig
from ..challenge.detectability import Detectability, crossing
from ..effects import catalogue
from ..effects.effect import Effect, EffectParameter
from ..effects.sizes import typical
from ..model import Model

SPLIT = (0.5, 1.5)
"""Each joint's or segment's share of the common size."""

FAR = 1e3
"""Factor on the plausible size: a neutral value further away is no end of a linear response."""

ON_OTHERS = ("backlash",)
"""Effects that need others which they do not include: on a rigid joint, the compliance of the gear
and the motor's inertia would show some five times the noise however small the backlash."""


def candidates() -> dict[str, Effect]:
    """The effects that stand alone and have sizes which the rig of the challenges can show."""
    model = bare_model()
    return {
        kind: e
        for kind, e in catalogue().items()
        if not (e.includes or kind in ON_OTHERS or e.not_applicable(challenge_rig(model)))
        and parameters_on(e, model)
    }


def parameters_on(e: Effect, model: Model) -> tuple[EffectParameter, ...]:
    """The effect's parameters on its arm, where the challenges show them."""
    arm = e.changed_arm(model.arm, {})
    quantities, rig = e.parameters(arm, model.drive, typical(arm)), challenge_rig(model)
    return tuple(quantity for quantity in quantities if e.shown(quantity.parameter.name, rig))


@dataclass(frozen=True)
class HiddenEffect:
    """An effect at a size, added to a model that lacks it."""

    effect: Effect
    values: Mapping[str, float]
    level: float
    """Size of its response, in noise rms per sample."""


def hide_effect(
    e: Effect, detectability: Detectability, level: float, rng: np.random.Generator
) -> HiddenEffect:
    """The effect at the size that shows `level`, in standard deviations of the noise;
    UnreachableError if no size shows that."""
    towards = _direction(e, detectability.base, rng)

    def shown(m: float) -> float:
        return detectability.of(detectability.base.with_effects([e], towards.values(m)))

    m, level_reached = crossing(shown, level)
    return HiddenEffect(e, towards.values(m), level_reached)


@dataclass(frozen=True)
class _Direction:
    """Shares and signs of an effect's sizes, which grow together."""

    sizes: tuple[EffectParameter, ...]
    shares: Mapping[str, float]
    """name of a size -> share with sign."""
    shapes: Mapping[str, float]
    """Values of the shape parameters."""

    def values(self, m: float) -> dict[str, float]:
        """The values at multiplier m of the plausible sizes; m = 0 is neutral."""
        values = dict(self.shapes)
        for quantity in self.sizes:
            p, share = quantity.parameter, self.shares[quantity.parameter.name]
            if abs(quantity.neutral) > FAR * abs(p.value):
                values[p.name] = min(p.value * abs(share) / m, quantity.neutral)
            else:
                values[p.name] = quantity.neutral + m * share * (p.value - quantity.neutral)
        return values


def _direction(e: Effect, model: Model, rng: np.random.Generator) -> _Direction:
    """Shares within SPLIT, free signs, plausible shapes."""
    quantities = parameters_on(e, model)
    sizes = tuple(k for k in quantities if not k.secondary)
    shares = {}
    for quantity in sizes:
        signed = quantity.parameter.lower < quantity.neutral < quantity.parameter.upper
        sign = rng.choice([-1.0, 1.0]) if signed else 1.0
        shares[quantity.parameter.name] = float(sign * rng.uniform(*SPLIT))
    shapes = {k.parameter.name: _shape(k, rng) for k in quantities if k.secondary}
    return _Direction(sizes, shares, shapes)


def _shape(quantity: EffectParameter, rng: np.random.Generator) -> float:
    """A random value on the parameter's grid, or near its plausible value."""
    if quantity.grid:
        low, high = np.log(min(quantity.grid)), np.log(max(quantity.grid))
        return float(np.exp(rng.uniform(low, high)))
    return float(quantity.parameter.value * rng.uniform(*SPLIT))
