"""What can be hidden in the plant: one function per effect, named by the id of the effect.

Parameters carry the names under which the truth is written, and SI units.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import reduce
from typing import Any

from tests.programs.mujoco.chain import Plant

Effects = Mapping[str, Mapping[str, float]]
"""Effect id -> parameter -> value."""


def _with_motors(plant: Plant, **pairs: tuple[float, float]) -> Plant:
    """The plant with other motors: each keyword holds the values of motor 1 and 2."""
    motors = (
        replace(motor, **{name: pair[i] for name, pair in pairs.items()})
        for i, motor in enumerate(plant.motors)
    )
    return replace(plant, motors=tuple(motors))


def coulomb_friction(plant: Plant, fc1: float, fc2: float) -> Plant:
    return _with_motors(plant, coulomb=(fc1, fc2))


def viscous_friction(plant: Plant, fv1: float, fv2: float) -> Plant:
    return _with_motors(plant, viscous=(fv1, fv2))


def tip_payload(plant: Plant, mt: float) -> Plant:
    return replace(plant, tip_mass=mt)


def joint_elasticity(plant: Plant, k1: float, k2: float, Jm1: float, Jm2: float) -> Plant:
    return _with_motors(plant, spring=(k1, k2), inertia=(Jm1, Jm2))


def rotor_inertia(plant: Plant, Jh1: float, Jh2: float) -> Plant:
    return _with_motors(plant, inertia=(Jh1, Jh2))


def gravity_tilt(plant: Plant, g1: float, g2: float) -> Plant:
    return replace(plant, gravity=(g1, g2))


def camera_delay(plant: Plant, td: float) -> Plant:
    return replace(plant, camera_delay=td)


def drive_saturation(plant: Plant, ul1: float, ul2: float) -> Plant:
    return _with_motors(plant, limit=(ul1, ul2))


def structural_damping(plant: Plant, tau: float) -> Plant:
    return replace(plant, damping_time=tau)


EFFECTS: dict[str, Callable[..., Plant]] = {
    make.__name__: make
    for make in (
        coulomb_friction, viscous_friction, tip_payload, joint_elasticity, rotor_inertia,
        gravity_tilt, camera_delay, drive_saturation, structural_damping,
    )
}  # fmt: skip


def with_effects(effects: Effects, rotors: tuple[float, float] = (0.0, 0.0)) -> Plant:
    """The paper's arm, on motors with these rotors (kg m²), with these effects in it."""

    def add(plant: Plant, item: tuple[str, Mapping[str, Any]]) -> Plant:
        return EFFECTS[item[0]](plant, **item[1])

    return reduce(add, effects.items(), rotor_inertia(Plant(), *rotors))
