"""Hidden effects of a chosen size.

Weak effects show half the noise, strong ones three times the noise; core.study.detectability says
what showing means. Each joint or segment has a random share of the size, and a random sign where
signs are free.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..effects import catalogue, effect, with_included
from ..effects.effect import Effect, EffectParameter
from ..effects.sizes import Sizes, typical
from ..model import Model
from ..study.detectability import Detectability, crossing
from ..study.study_rig import Experiment, bare_model, study_rig

SPLIT = (0.5, 1.5)
"""Each joint's or segment's share of the common size."""

FAR = 1e3
"""Times the plausible size: from there on a neutral value is no end of a straight line."""

BEFORE = {"backlash": ("joint_elasticity",)}
"""kind -> what must be known beside what the effect includes. Teeth with play are elastic teeth: on
a rigid joint their compliance and the motor's own inertia would be the larger surprise, some five
times the noise however small the play."""

LEVELS_OF_MODEL = ("large_motion",)
"""What is no effect of the arm but a level of the model: a diagnosis uses the full equations, so
it cannot be missing there."""


def candidates() -> dict[str, Effect]:
    """All effects that the rig of the studies can show."""
    rig = study_rig(bare_model())
    return {
        kind: one
        for kind, one in catalogue().items()
        if kind not in LEVELS_OF_MODEL and not one.not_applicable(rig)
    }


def prerequisites(one: Effect) -> tuple[Effect, ...]:
    """What must be in a model before `one` is a question of its own, simpler ones first.

    Above all what it includes: Stribeck's bulge stands on Coulomb's level, and on a bare model
    that level would be the larger surprise.
    """
    kinds = (*one.includes, *BEFORE.get(one.kind, ()))
    return with_included([effect(kind) for kind in kinds])


def parameters_on(
    one: Effect, model: Model, sizes: Sizes | None = None
) -> tuple[EffectParameter, ...]:
    """Its parameters on the arm that it makes of the model's, where the studies show them."""
    arm = one.changed_arm(model.arm, {})
    quantities, rig = one.parameters(arm, model.drive, sizes or typical(arm)), study_rig(model)
    return tuple(quantity for quantity in quantities if one.shown(quantity.parameter.name, rig))


@dataclass(frozen=True)
class Direction:
    """In which proportions and with which signs an effect's sizes grow together."""

    effect: Effect
    parameters: tuple[EffectParameter, ...]
    shares: Mapping[str, float]
    """name of a size -> share with sign."""
    fixed: Mapping[str, float]
    """Values of what shapes the effect."""

    def values(self, m: float) -> dict[str, float]:
        """The values at the common multiplier m of the plausible sizes; neutral towards zero."""
        found = dict(self.fixed)
        for quantity in self.parameters:
            p, share = quantity.parameter, self.shares[quantity.parameter.name]
            if abs(quantity.neutral) > FAR * abs(p.value):
                found[p.name] = min(p.value * abs(share) / m, quantity.neutral)
            else:
                found[p.name] = quantity.neutral + m * share * (p.value - quantity.neutral)
        return found

    def within(self, m: float) -> bool:
        """Whether all sizes stay within what a fit believes."""
        values = self.values(m)
        return all(
            k.parameter.lower <= values[k.parameter.name] <= k.parameter.upper
            or values[k.parameter.name] == k.neutral
            for k in self.parameters
        )


def direction(one: Effect, model: Model, sizes: Sizes, rng: np.random.Generator) -> Direction:
    """A random one: shares within SPLIT, signs where they are free, plausible shapes.

    What shapes it and is in the model already stays as it is there.
    """
    quantities = parameters_on(one, model, sizes)
    primary = tuple(k for k in quantities if not k.secondary)
    shares = {}
    for quantity in primary:
        signed = quantity.parameter.lower < quantity.neutral < quantity.parameter.upper
        sign = rng.choice([-1.0, 1.0]) if signed else 1.0
        shares[quantity.parameter.name] = float(sign * rng.uniform(*SPLIT))
    fixed = {k.parameter.name: _shape(k, rng) for k in quantities if k.secondary}
    fixed = {name: model.effect_values.get(name, value) for name, value in fixed.items()}
    return Direction(one, primary, shares, fixed)


def _shape(quantity: EffectParameter, rng: np.random.Generator) -> float:
    """Somewhere on the parameter's grid, else near its plausible value."""
    if quantity.grid:
        low, high = np.log(min(quantity.grid)), np.log(max(quantity.grid))
        return float(np.exp(rng.uniform(low, high)))
    return float(quantity.parameter.value * rng.uniform(*SPLIT))


@dataclass(frozen=True)
class HiddenEffect:
    """An effect at a size, on top of a model that lacks it."""

    kind: str
    base: Model
    """With what is known before, at its true values."""
    values: Mapping[str, float]
    level: float
    """What it shows, in noise rms per sample."""
    sizes: Sizes

    @property
    def truth(self) -> Model:
        """The model with the effect in it."""
        return with_added(self.base, [effect(self.kind)], self.values, self.sizes)


def hide_effect(
    one: Effect,
    bare: Model,
    experiments: Sequence[Experiment],
    level: float,
    rng: np.random.Generator,
) -> HiddenEffect:
    """The effect at the size that shows `level` in the experiments; as it is if it has no size.

    Unreachable where no size shows that.
    """
    known, detectability = prerequisites(one), Detectability(bare, experiments)
    sizes = detectability.sizes
    if not parameters_on(one, bare, sizes):
        return HiddenEffect(
            one.kind, bare, {}, detectability.of(with_added(bare, [one], {}, sizes)), sizes
        )
    carriers = _directions(known, bare, sizes, rng)
    if known and _has_no_own_force(one, carriers, detectability):
        return _hide_with_prerequisites(one, carriers, detectability, level, rng)
    base = _with_prerequisites(bare, carriers, PREREQUISITE_SIZE, sizes)
    detectability = Detectability(base, experiments) if known else detectability
    towards = direction(one, base, sizes, rng)

    def shown(m: float) -> float:
        return detectability.of(with_added(base, [one], towards.values(m), sizes))

    m, found = crossing(shown, level)
    return HiddenEffect(one.kind, base, towards.values(m), found, sizes)


def _directions(
    effects: Sequence[Effect], bare: Model, sizes: Sizes, rng: np.random.Generator
) -> list[Direction]:
    """One after the other, so that what shapes two of them is the same in both."""
    found: list[Direction] = []
    for each in effects:
        found.append(
            direction(each, _with_prerequisites(bare, found, PREREQUISITE_SIZE, sizes), sizes, rng)
        )
    return found


def _with_prerequisites(
    bare: Model, carriers: Sequence[Direction], m: float, sizes: Sizes
) -> Model:
    values = {name: x for each in carriers for name, x in each.values(m).items()}
    return bare.with_effects([each.effect for each in carriers], values, sizes)


NEARLY = 1e-6
"""Of a plausible size: as good as neutral."""

UNSEEN = 0.02
"""In noise rms: what two simulations with different steps differ by."""

PREREQUISITE_SIZE = 0.3
"""Of the plausible size: of what is known before, so that it does not drown what is sought."""


def _has_no_own_force(
    one: Effect, carriers: Sequence[Direction], detectability: Detectability
) -> bool:
    """Whether the effect vanishes with what it includes: presliding has no force of its own."""
    base = _with_prerequisites(detectability.base, carriers, NEARLY, detectability.sizes)
    plausible = {
        k.parameter.name: k.parameter.value for k in parameters_on(one, base, detectability.sizes)
    }
    return detectability.of(with_added(base, [one], plausible, detectability.sizes)) < UNSEEN


def _hide_with_prerequisites(
    one: Effect,
    carriers: Sequence[Direction],
    detectability: Detectability,
    level: float,
    rng: np.random.Generator,
) -> HiddenEffect:
    """Sized by what it includes; its own parameters lie anywhere on their grids."""
    bare, sizes = detectability.base, detectability.sizes
    values = {k.parameter.name: _shape(k, rng) for k in parameters_on(one, bare, sizes)}

    def shown(m: float) -> float:
        base = _with_prerequisites(bare, carriers, m, sizes)
        own = Detectability(base, detectability.experiments)
        return own.of(with_added(base, [one], values, sizes))

    m, found = crossing(shown, level)
    return HiddenEffect(
        one.kind, _with_prerequisites(bare, carriers, m, sizes), values, found, sizes
    )


def with_added(
    base: Model, effects: Sequence[Effect], values: Mapping[str, float], sizes: Sizes
) -> Model:
    """The base with more effects on top of those that it has."""
    return base.with_effects([*base.effects, *effects], values, sizes)
