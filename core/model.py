"""A model: an arm, its drive, and the level at which it is simulated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from .arm.arm import Arm, Structure
from .arm.catalogue import ArmCatalogue
from .arm.compiled import CompiledArm, compile_arm
from .drives.drive import Drive
from .drives.law import DriveLaw
from .drives.servo import FollowingServo, Steering
from .effects import with_included
from .effects.effect import Effect
from .effects.sizes import Sizes, typical
from .errors import InputError
from .forces.element import Element, ElementArrays, pack
from .parameters import Parameter
from .sentences import did_you_mean
from .validation import finite_number

LEVELS = ("lpv", "nonlinear")


class Numbers(NamedTuple):
    """A model's numbers at given parameter values."""

    p: np.ndarray
    law: DriveLaw
    elements: tuple[Element, ...] = ()
    """Extra forces of the effects."""
    inputs: tuple[str, ...] = ()
    """Names of the signals of a recording that these forces depend on."""

    def packed(self, n: int) -> ElementArrays:
        """The extra forces as compiled code takes them, on an arm with n coordinates."""
        return pack(self.elements, n, self.inputs, len(self.law.R))


@dataclass(frozen=True)
class Model:
    """An arm with what drives it; `values` are parameter values that differ from the arm's."""

    arm: Arm
    drive: Drive
    level: str = "nonlinear"
    steering: FollowingServo | None = None
    """The virtual servo that leads the joints along a recording, where one is used."""
    effects: tuple[Effect, ...] = ()
    """What is in the model beyond the bare arm; `arm` is the arm with them."""
    effect_values: Mapping[str, float] = field(default_factory=dict)
    """The effects' parameters where nothing else is said."""
    bare: Model | None = None
    """The model without effects; None where there are none."""

    def __post_init__(self) -> None:
        self.drive.check(self.arm)
        if self.level not in LEVELS:
            raise InputError(f"[model] level {self.level!r}: {did_you_mean(self.level, LEVELS)}")

    @cached_property
    def compiled(self) -> CompiledArm:
        """The arm's compiled equations."""
        return compile_arm(Structure.of(self.arm))

    @cached_property
    def arm_catalogue(self) -> ArmCatalogue:
        """The arm's parameters."""
        return ArmCatalogue(self.arm)

    @cached_property
    def parameters(self) -> dict[str, Parameter]:
        """All that can be estimated, by name."""
        own = {item.name: item for item in self.drive.parameters(self.arm)}
        return {**self.arm_catalogue.parameters, **own, **self.effect_parameters}

    @cached_property
    def effect_parameters(self) -> dict[str, Parameter]:
        """Those of the effects, at the values that the model has."""
        sizes = typical(self.arm)
        parameters = {}
        for effect in self.effects:
            for quantity in effect.parameters(self.arm, self.drive, sizes):
                item = quantity.parameter
                value = self.effect_values.get(item.name, item.value)
                lower, upper = min(item.lower, value), max(item.upper, value)
                parameters[item.name] = replace(item, value=value, lower=lower, upper=upper)
        return parameters

    @cached_property
    def inputs(self) -> tuple[str, ...]:
        """Names of the signals of a recording that the effects' forces depend on."""
        return tuple(dict.fromkeys(name for effect in self.effects for name in effect.inputs))

    def origin(self, name: str) -> str:
        """What a parameter belongs to: the id of an effect, 'drive', 'arm', or else 'sensor'."""
        sizes = typical(self.arm)
        for effect in reversed(self.effects):
            quantities = effect.parameters(self.arm, self.drive, sizes)
            if any(k.parameter.name == name for k in quantities):
                return effect.kind
        if any(item.name == name for item in self.drive.parameters(self.arm)):
            return "drive"
        return "arm" if name in self.arm_catalogue.entries else "sensor"

    def parameter(self, name: str, where: str = "[identify] parameters") -> Parameter:
        """The parameter of that name; InputError with the nearest known one otherwise."""
        if name not in self.parameters:
            hint = did_you_mean(name, self.parameters)
            raise InputError(f"{where}: {name!r} is not a parameter of this arm; {hint}")
        return self.parameters[name]

    def check_values(self, values: Mapping[str, object], where: str = "values") -> None:
        """InputError for a value of no parameter, for one that is no number, and for one with a
        sign that its parameter cannot have."""
        for name, given in values.items():
            lower = self.parameter(name, where).lower
            value = finite_number(given, f"{where}: {name}")
            if value < 0.0 <= lower or value == 0.0 < lower:
                least = "greater than" if lower > 0.0 else "at least"
                raise InputError(f"{where}: {name} is {value:g}; it must be {least} 0.")

    @property
    def active_steering(self) -> Steering:
        """What moves the joints: a virtual servo where there is one, else the drive."""
        return self.steering if self.steering is not None else self.drive

    @property
    def servo(self) -> FollowingServo:
        """The virtual servo, where it is known that there is one."""
        assert self.steering is not None
        return self.steering

    def arm_vectors(self, names: Sequence[str], values: np.ndarray) -> np.ndarray:
        """p (S, np) for S vectors `values` (S, len(names)); names of the drive are passed over."""
        entries = self.arm_catalogue.entries
        own = [i for i, name in enumerate(names) if name in entries]
        return self.arm_catalogue.vectors([names[i] for i in own], values[:, own])

    def numbers(self, values: Mapping[str, float] | None = None) -> Numbers:
        """p and the drive's law at the arm's own values, changed by `values`."""
        values = values or {}
        own = {name: value for name, value in values.items() if name in self.parameters}
        own = {**self.effect_values, **own}
        vector = np.array([list(own.values())], dtype=float)
        p = self.arm_vectors(list(own), vector)[0]
        law = self.active_steering.law(self.arm, p, own)
        elements: list[Element] = []
        for effect in self.effects:
            law = effect.law(law, self.arm, p, own)
            elements += effect.elements(self.arm, p, own)
        return Numbers(p, law, tuple(elements), self.inputs)

    def sensed(
        self, sensor: str, y: np.ndarray, dt: float, values: Mapping[str, float],
        moving: bool = False,
    ) -> np.ndarray:  # fmt: skip
        """What a kind of sensor reads (N, k), from what an ideal one would, y (N, k), every `dt`
        s. Before the first sample the arm rests or, where it was `moving`, y came straight on:
        what is late then shows it."""
        all_values, first = {**self.effect_values, **values}, 0
        if moving and self.effects and len(y) > 2:
            first = len(y)
            slope = 2.0 * y[1] - 1.5 * y[0] - 0.5 * y[2]
            y = np.vstack([y[0] + np.arange(-first, 0)[:, None] * slope, y])
        for effect in self.effects:
            y = effect.sensed(sensor, y, dt, all_values)
        return y[first:]

    def started(self, joints: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
        """True joint positions (..., nj) from what the encoders say, `joints` (..., nj)."""
        all_values = {**self.effect_values, **values}
        for effect in self.effects:
            joints = effect.started(joints, all_values)
        return joints

    def followed(self, joints: np.ndarray, dt: float, values: Mapping[str, float]) -> np.ndarray:
        """True joint positions (N, nj) every `dt` s from those that the encoders give a servo,
        `joints` (N, nj)."""
        all_values = {**self.effect_values, **values}
        for effect in self.effects:
            joints = effect.followed(joints, dt, all_values)
        return joints

    def with_effects(
        self,
        effects: Sequence[Effect],
        values: Mapping[str, float] | None = None,
        sizes: Sizes | None = None,
    ) -> Model:
        """The bare model with these effects and what they include, instead of those it has.

        `values` are sizes; an effect whose parameters are not among them starts at plausible
        ones. An effect whose own parameters are all neutral is left out.
        """
        bare, sizes = self.bare or self, sizes or typical(self.arm)
        model = bare
        starts = {**self.effect_values, **(values or {})}
        included = with_included(effects)
        for effect in included:
            model = model._with(effect, bare, starts, sizes, part=False)
        parts = {kind for effect in model.effects for kind in effect.includes}
        if parts <= {effect.kind for effect in model.effects}:
            return model
        model = bare  # a neutral part of an effect that is there stays, for its parameters
        for effect in included:
            model = model._with(effect, bare, starts, sizes, part=effect.kind in parts)
        return model

    def _with(
        self, effect: Effect, bare: Model, values: Mapping[str, float], sizes: Sizes, part: bool
    ) -> Model:
        arm = effect.changed_arm(self.arm, values)
        quantities = effect.parameters(arm, self.drive, sizes)
        names = [quantity.parameter.name for quantity in quantities]
        some = any(name in values for name in names)
        plain = {
            k.parameter.name: k.neutral if some and k.separate else k.parameter.value
            for k in quantities
        }
        starts = {name: values.get(name, value) for name, value in plain.items()}
        neutral = {k.parameter.name: k.neutral for k in quantities if not k.secondary}
        if names and not part and all(starts[name] == value for name, value in neutral.items()):
            return self
        return replace(
            self,
            arm=arm,
            level=effect.level(self.level),
            effects=(*self.effects, effect),
            effect_values={**self.effect_values, **starts},
            bare=bare,
        )

    def stretched_matrices(self) -> tuple[np.ndarray, np.ndarray]:
        """Stiffness and mass (n, n) of the arm stretched out, at its own values."""
        n, p = self.arm.coordinates, self.numbers().p
        K, _ = self.compiled.linear_matrices(np.zeros(n), p)
        M = self.compiled.mass_matrix(np.zeros(n), p)
        return 0.5 * (K + K.T), 0.5 * (M + M.T)

    def at_level(self, level: str) -> Model:
        """The same at another level, 'lpv' or 'nonlinear'."""
        return replace(self, level=level)

    def steered_by(self, steering: FollowingServo | None) -> Model:
        """The same with another virtual servo; None: by its drive."""
        bare = None if self.bare is None else replace(self.bare, steering=steering)
        return replace(self, steering=steering, bare=bare)
