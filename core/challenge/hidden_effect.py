"""Hidden effects of a chosen size.

Weak effects show half the noise, strong ones three times the noise
(core.challenge.detectability). Each joint or segment has a random share of the size, and a random
sign if signs are free.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..challenge.challenge_rig import Experiment, bare_model, challenge_rig
from ..challenge.detectability import Detectability, crossing
from ..effects import catalogue, effect, with_included
from ..effects.effect import Effect, EffectParameter
from ..effects.sizes import Sizes, typical
from ..model import Model

SPLIT = (0.5, 1.5)
"""Each joint's or segment's share of the common size."""

FAR = 1e3
"""Factor on the plausible size: a neutral value further away is no end of a linear response."""

BEFORE = {"backlash": ("joint_elasticity",)}
"""kind -> prerequisites beside those that the effect includes. Backlash needs elastic joints: on a
rigid joint, their compliance and the motor's inertia would show some five times the noise however
small the backlash."""

LEVELS_OF_MODEL = ("large_motion",)
"""Levels of the model, which are no effects: a diagnosis uses the full equations, so they cannot be
missing."""


def candidates() -> dict[str, Effect]:
    """All effects that the rig of the challenges can show."""
    rig = challenge_rig(bare_model())
    return {
        kind: e
        for kind, e in catalogue().items()
        if kind not in LEVELS_OF_MODEL and not e.not_applicable(rig)
    }


def prerequisites(e: Effect) -> tuple[Effect, ...]:
    """Effects that the model must contain first, simpler ones first: above all those that the
    effect includes. Without Coulomb friction, for example, its level would dominate the Stribeck
    effect."""
    kinds = (*e.includes, *BEFORE.get(e.kind, ()))
    return with_included([effect(kind) for kind in kinds])


def parameters_on(
    e: Effect, model: Model, sizes: Sizes | None = None
) -> tuple[EffectParameter, ...]:
    """The effect's parameters on its arm, where the challenges show them."""
    arm = e.changed_arm(model.arm, {})
    quantities, rig = e.parameters(arm, model.drive, sizes or typical(arm)), challenge_rig(model)
    return tuple(quantity for quantity in quantities if e.shown(quantity.parameter.name, rig))


@dataclass(frozen=True)
class Direction:
    """Shares and signs of an effect's sizes, which grow together."""

    effect: Effect
    parameters: tuple[EffectParameter, ...]
    shares: Mapping[str, float]
    """name of a size -> share with sign."""
    fixed: Mapping[str, float]
    """Values of the shape parameters."""

    def values(self, m: float) -> dict[str, float]:
        """The values at multiplier m of the plausible sizes; m = 0 is neutral."""
        values = dict(self.fixed)
        for quantity in self.parameters:
            p, share = quantity.parameter, self.shares[quantity.parameter.name]
            if abs(quantity.neutral) > FAR * abs(p.value):
                values[p.name] = min(p.value * abs(share) / m, quantity.neutral)
            else:
                values[p.name] = quantity.neutral + m * share * (p.value - quantity.neutral)
        return values

    def within(self, m: float) -> bool:
        """Whether all sizes, at m times the plausible ones, are within the bounds of a fit."""
        values = self.values(m)
        return all(
            k.parameter.lower <= values[k.parameter.name] <= k.parameter.upper
            or values[k.parameter.name] == k.neutral
            for k in self.parameters
        )


def direction(e: Effect, model: Model, sizes: Sizes, rng: np.random.Generator) -> Direction:
    """A random direction: shares within SPLIT, free signs, plausible shapes; shapes already in the
    model stay."""
    quantities = parameters_on(e, model, sizes)
    primary = tuple(k for k in quantities if not k.secondary)
    shares = {}
    for quantity in primary:
        signed = quantity.parameter.lower < quantity.neutral < quantity.parameter.upper
        sign = rng.choice([-1.0, 1.0]) if signed else 1.0
        shares[quantity.parameter.name] = float(sign * rng.uniform(*SPLIT))
    fixed = {k.parameter.name: _shape(k, rng) for k in quantities if k.secondary}
    fixed = {name: model.effect_values.get(name, value) for name, value in fixed.items()}
    return Direction(e, primary, shares, fixed)


def _shape(quantity: EffectParameter, rng: np.random.Generator) -> float:
    """A random value on the parameter's grid, or near its plausible value."""
    if quantity.grid:
        low, high = np.log(min(quantity.grid)), np.log(max(quantity.grid))
        return float(np.exp(rng.uniform(low, high)))
    return float(quantity.parameter.value * rng.uniform(*SPLIT))


@dataclass(frozen=True)
class HiddenEffect:
    """An effect at a size, added to a model that lacks it."""

    kind: str
    base: Model
    """The model with the prerequisites at their true values."""
    values: Mapping[str, float]
    level: float
    """Size of its response, in noise rms per sample."""
    sizes: Sizes

    @property
    def truth(self) -> Model:
        """The model with the effect in it."""
        return with_added(self.base, [effect(self.kind)], self.values, self.sizes)


def hide_effect(
    e: Effect, bare: Model, experiments: Sequence[Experiment], level: float,
    rng: np.random.Generator,
) -> HiddenEffect:  # fmt: skip
    """The effect at the size that shows `level`, in standard deviations of the noise, in the
    experiments, or as it is without a size. UnreachableError if no size shows that."""
    needed, detectability = prerequisites(e), Detectability(bare, experiments)
    sizes = detectability.sizes
    if not parameters_on(e, bare, sizes):
        return HiddenEffect(
            e.kind, bare, {}, detectability.of(with_added(bare, [e], {}, sizes)), sizes
        )
    carriers = _directions(needed, bare, sizes, rng)
    if needed and _has_no_own_force(e, carriers, detectability):
        return _hide_with_prerequisites(e, carriers, detectability, level, rng)
    base = _with_prerequisites(bare, carriers, PREREQUISITE_SIZE, sizes)
    detectability = Detectability(base, experiments) if needed else detectability
    towards = direction(e, base, sizes, rng)

    def shown(m: float) -> float:
        return detectability.of(with_added(base, [e], towards.values(m), sizes))

    m, level_reached = crossing(shown, level)
    return HiddenEffect(e.kind, base, towards.values(m), level_reached, sizes)


def _directions(
    effects: Sequence[Effect], bare: Model, sizes: Sizes, rng: np.random.Generator
) -> list[Direction]:
    """The directions of some effects; shared shape parameters are equal."""
    directions: list[Direction] = []
    for each in effects:
        directions.append(
            direction(
                each, _with_prerequisites(bare, directions, PREREQUISITE_SIZE, sizes), sizes, rng
            )
        )
    return directions


def _with_prerequisites(
    bare: Model, carriers: Sequence[Direction], m: float, sizes: Sizes
) -> Model:
    values = {name: x for each in carriers for name, x in each.values(m).items()}
    return bare.with_effects([each.effect for each in carriers], values, sizes)


NEARLY = 1e-6
"""Share of a plausible size that is as good as neutral."""

UNSEEN = 0.02
"""In noise rms: difference of simulations with different steps."""

PREREQUISITE_SIZE = 0.3
"""Share of the plausible size for prerequisites, so that they do not dominate."""


def _has_no_own_force(
    e: Effect, carriers: Sequence[Direction], detectability: Detectability
) -> bool:
    """Whether the effect vanishes with its prerequisites: presliding has no force of its own."""
    base = _with_prerequisites(detectability.base, carriers, NEARLY, detectability.sizes)
    plausible = {
        k.parameter.name: k.parameter.value for k in parameters_on(e, base, detectability.sizes)
    }
    return detectability.of(with_added(base, [e], plausible, detectability.sizes)) < UNSEEN


def _hide_with_prerequisites(
    e: Effect, carriers: Sequence[Direction], detectability: Detectability, level: float,
    rng: np.random.Generator,
) -> HiddenEffect:  # fmt: skip
    """The effect, sized by its prerequisites; its own parameters are random on their grids."""
    bare, sizes = detectability.base, detectability.sizes
    values = {k.parameter.name: _shape(k, rng) for k in parameters_on(e, bare, sizes)}

    def shown(m: float) -> float:
        base = _with_prerequisites(bare, carriers, m, sizes)
        own = Detectability(base, detectability.experiments)
        return own.of(with_added(base, [e], values, sizes))

    m, level_reached = crossing(shown, level)
    return HiddenEffect(
        e.kind, _with_prerequisites(bare, carriers, m, sizes), values, level_reached, sizes
    )


def with_added(
    base: Model, effects: Sequence[Effect], values: Mapping[str, float], sizes: Sizes
) -> Model:
    """The base with more effects."""
    return base.with_effects([*base.effects, *effects], values, sizes)
