"""Helps for effects with one parameter per joint, and the parameters that most effects have."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from core.arm.arm import Arm
from core.effects.effect import EffectParameter, Values
from core.forces.element import Element
from core.parameters import Parameter

if TYPE_CHECKING:
    from core.forces.law import ForceLaw


def joint_direction(arm: Arm, k: int) -> np.ndarray:
    """(n,) with which a force acts on the motor's side of joint k (from 0)."""
    return np.eye(arm.coordinates)[k]


def joint_elements(
    arm: Arm, law: ForceLaw, names: Sequence[str], values: Values
) -> tuple[Element, ...]:
    """The law at every joint, with the values of `names` + joint number."""
    return tuple(
        Element(law, (joint_direction(arm, k),), tuple(values[f"{n}{k + 1}"] for n in names))
        for k in range(arm.joints)
    )


def sized(
    name: str,
    start: float,
    unit: str,
    title: str,
    symbol: str,
    *,
    signed: bool = False,
    largest: float = 1e3,
    neutral: float = 0.0,
    grid: Sequence[float] = (),
    secondary: bool = False,
) -> EffectParameter:
    """A parameter with bounds that grow with its start; the sign is fixed unless `signed`.

    `largest` times the start is the upper bound.
    """
    upper = largest * abs(start)
    lower = -upper if signed else 0.0
    parameter = Parameter(name, start, unit, lower, upper, symbol, title, scale=abs(start))
    return EffectParameter(parameter, neutral, tuple(grid), secondary)


def each_joint(arm: Arm, make: Callable[[int], EffectParameter]) -> tuple[EffectParameter, ...]:
    """One parameter per joint, `make(k)` with k from 0."""
    return tuple(make(k) for k in range(arm.joints))


def positive(
    name: str,
    start: float,
    unit: str,
    title: str,
    symbol: str,
    *,
    lower: float,
    upper: float,
    neutral: float = 0.0,
    grid: Sequence[float] = (),
    secondary: bool = False,
    finely: Sequence[float] = (),
) -> EffectParameter:
    """A parameter with both bounds stated; the neutral value may lie outside them."""
    parameter = Parameter(name, start, unit, lower, upper, symbol, title, scale=start)
    return EffectParameter(parameter, neutral, tuple(grid), secondary, tuple(finely))
