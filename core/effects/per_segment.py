"""Helps for effects with one parameter per bending segment, and for parameters of the arm."""

from __future__ import annotations

from dataclasses import replace

from ..arm.arm import Arm
from ..arm.catalogue import arm_parameters
from ..effects.effect import EffectParameter, Rig


def bending(arm: Arm) -> tuple[int, ...]:
    """Segments (from 0) that bend."""
    return tuple(k for k, modes in enumerate(arm.modes) if modes)


def unbent(rig: Rig) -> str:
    """The sentence for an effect of bending; empty where a segment bends."""
    return "" if rig.bends else "No segment of this arm bends."


def arm_parameter(arm: Arm, name: str, step: float, lower: float, upper: float) -> EffectParameter:
    """The arm's parameter of that name: neutral at its stated value, starting one `step` above;
    `step`, `lower` and `upper` bound in its unit."""
    own = arm_parameters(arm)[name]
    parameter = replace(own, value=own.value + step, lower=lower, upper=upper, scale=abs(step))
    return EffectParameter(parameter, neutral=own.value)
