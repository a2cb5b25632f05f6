"""Helps for effects with one parameter per joint, and the parameters that most effects have."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arm.arm import Arm
from ..arm.catalogue import symbol as symbol_of
from ..arm.joints import joint
from ..arm.joints.joint import Joint
from ..effects.effect import EffectParameter, Values
from ..forces.element import Element
from ..parameters import Parameter

if TYPE_CHECKING:
    from ..forces.law import ForceLaw


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
    *,
    lower: float | None = None,
    upper: float | None = None,
    signed: bool = False,
    symbol: str = "",
    neutral: float = 0.0,
    grid: Sequence[float] = (),
    secondary: bool = False,
    fine_grid: Sequence[float] = (),
) -> EffectParameter:
    """A parameter with bounds `lower`, `upper` in its `unit`, which `neutral` may lie outside of.

    Without an upper one it may grow to a thousand times its start; without a lower one the sign
    is fixed unless `signed`. The symbol follows from the name where none is stated.
    """
    start = float(start)
    most = 1e3 * abs(start) if upper is None else float(upper)
    least = (-most if signed else 0.0) if lower is None else float(lower)
    parameter = Parameter(
        name, start, unit, least, most, symbol or symbol_of(name), title, scale=abs(start)
    )
    return EffectParameter(parameter, neutral, tuple(grid), secondary, tuple(fine_grid))


Each = float | np.ndarray
"""The same for every joint, or (joints,)."""


def each_joint(
    arm: Arm,
    stem: str,
    title: str,
    unit: Callable[[Joint], str],
    start: Each,
    *,
    lower: Each | None = None,
    upper: Each | None = None,
    neutral: Each = 0.0,
    grid: np.ndarray | None = None,
    **shape: Any,
) -> tuple[EffectParameter, ...]:
    """One parameter per joint: `stem` and its number, `{}` in the title; `grid` (joints, sizes)
    and `shape` as for `sized`."""

    def of(values: Each | None, k: int) -> Any:
        return None if values is None else np.broadcast_to(values, arm.joints)[k].item()

    return tuple(
        sized(
            f"{stem}{k + 1}", of(start, k), unit(joint(s.joint)), title.format(k + 1),
            lower=of(lower, k), upper=of(upper, k), neutral=of(neutral, k),
            grid=() if grid is None else grid[k].tolist(), **shape,
        )
        for k, s in enumerate(arm.segments)
    )  # fmt: skip
