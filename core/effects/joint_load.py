"""What a joint moves, the measure of a small inertia on its motor's side, and joints that twist."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import sympy as sp

from ..arm.arm import Arm
from ..arm.catalogue import arm_parameters
from ..arm.joints import joint
from ..effects.effect import EffectParameter

START_LOAD = 0.05
"""Of what the joint moves: a plausible rotor and gear to begin with."""

HEAVIEST = 10.0
"""Times what the joint moves, or its own: the most that a motor or a column plausibly has."""

LEAST_LOAD = 0.01
"""Of what the joint moves: an elastic joint's motor without inertia would have no motion of its
own, and one far lighter than this shows nothing of its size."""


def joint_load(arm: Arm, k: int) -> float:
    """kg m^2 (kg on a slide) that joint k (from 0) moves with the arm rigid and stretched."""
    turns = joint(arm.segments[k].joint).place(sp.Symbol("q"), sp.Integer(0)).turn != 0
    total, reach = 0.0, 0.0
    for i, s in enumerate(arm.segments[k:]):
        if i and s.mount == "ground":
            break
        (along, across), end = s.centre, reach + s.length
        spun = s.mass * ((reach + along) ** 2 + across**2) + s.central_inertia
        spun += s.tip_mass * end**2 + s.tip_inertia
        total += spun if turns else s.mass + s.tip_mass
        reach = end
    return total


def hub_parameters(
    arm: Arm, *, least: float = 0.0, secondary: bool = False
) -> tuple[EffectParameter, ...]:
    """The hub inertia Jh of every joint, at least `least` times what the joint moves. Without a
    gear, what a carried motor turns with its joint turns with the segment that carries it too."""
    return tuple(
        replace(
            _inertia(arm, k, f"Jh{k + 1}", START_LOAD, least, secondary),
            ruled_out_by="direct_drive" if arm.carries_motor(k) else "",
        )
        for k in range(arm.joints)
    )


def rotor_parameters(arm: Arm, *, secondary: bool = False) -> tuple[EffectParameter, ...]:
    """The inertia Jr of a rotor without a gear, of every joint whose motor is carried along."""
    return tuple(
        replace(
            _inertia(arm, k, f"Jr{k + 1}", LEAST_LOAD, 0.0, secondary),
            separate=True,
            ruled_out_by="gear_ratio",
        )
        for k in range(arm.joints)
        if arm.carries_motor(k)
    )


def _inertia(
    arm: Arm, k: int, name: str, share: float, least: float, secondary: bool
) -> EffectParameter:
    """J of joint k (from 0), that begins at a `share` of what the joint moves, or above its own."""
    load, own = joint_load(arm, k), arm_parameters(arm)[name]
    start = max(1.2 * own.value, share * load)
    most = HEAVIEST * max(own.value, load)
    parameter = replace(own, value=start, lower=least * load, upper=most, scale=start)
    return EffectParameter(parameter, neutral=own.value, secondary=secondary)


def with_twisting_joints(
    arm: Arm, sizes: Mapping[int, float], compliance: Callable[[int, float], float]
) -> Arm:
    """The arm with the joints (from 0) whose size is above zero made elastic.

    `compliance(k, size)` is in rad/(N m) (m/N). The motor of such a joint gets a hub of
    at least LEAST_LOAD times what the joint moves.
    """
    segments = list(arm.segments)
    for k, size in sizes.items():
        if size > 0.0:
            s = segments[k]
            hub = max(s.hub_inertia, LEAST_LOAD * joint_load(arm, k))
            update = {"joint_compliance": compliance(k, size), "hub_inertia": hub}
            segments[k] = s.model_copy(update=update)
    return arm.model_copy(update={"segments": tuple(segments)})
