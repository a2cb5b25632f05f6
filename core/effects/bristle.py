"""Dry friction as a bristle (P. Dahl, 1968): it bends over a tiny distance, holds, and slips.

With a smoothed sign of the velocity a joint at rest would creep; a bristle does not.
"""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from ..arm.arm import Arm
from ..arm.joints import joint
from ..effects.effect import Values
from ..effects.per_joint import joint_elements
from ..forces.element import Element
from ..forces.law import ForceLaw, V, W, joint_law

_RIGID = {"rad": 1e-6, "m": 1e-6}
"""rad and m over which surfaces that are called rigid break away: a tenth of what an encoder
resolves. In recordings of an arm whose joints stick, simulated by another engine, a hundredth of
it moves the levels by half a per cent, ten times as much by two; the integrator needs no more
steps for the one than for the other. On a slide of a published benchmark the levels come back
within half a per cent."""

IDEALISED = 0.05
"""Measured friction follows one law within some per cent at best: it changes with temperature,
place and time (B. Armstrong-Helouvry et al., Automatica 30, 1994)."""

BREAKAWAY = "zs"
"""With the joint's number: the name of a joint's breakaway displacement, where it has one."""

_ZS = sp.Symbol("z_s", positive=True)


def bristle_law(level: sp.Expr, parameters: tuple[sp.Symbol, ...]) -> ForceLaw:
    """-level u at a joint, u' = (v - |v| u) / z_s; the breakaway displacement z_s comes after the
    parameters.

    u is the share of the level that the bristle gives, in [-1, 1].
    """
    return bristle_force(-level * W, parameters)


def bristle_force(
    force: sp.Expr, parameters: tuple[sp.Symbol, ...], load: sp.Symbol | None = None
) -> ForceLaw:
    """The same with any force of the bristle's share `W`; where it depends on the drive's torque
    `load`, that comes last of all."""
    rate = (V - sp.Abs(V) * W) / _ZS
    last = () if load is None else (load,)
    return joint_law(force, (*parameters, _ZS, *last), rate, bristle=True)


def breakaway(arm: Arm, k: int, values: Values) -> float:
    """rad (m): over which the dry friction of joint k (from 0) breaks away."""
    rigid = _RIGID[joint(arm.segments[k].joint).coordinate_unit]
    return max(values.get(f"{BREAKAWAY}{k + 1}", 0.0), rigid)


def bristles(arm: Arm, law: ForceLaw, names: Sequence[str], values: Values) -> tuple[Element, ...]:
    """A law of `bristle_law` at every joint, with the values of `names` + joint number."""
    lengths = {f"{BREAKAWAY}{k + 1}": breakaway(arm, k, values) for k in range(arm.joints)}
    return joint_elements(arm, law, (*names, BREAKAWAY), {**values, **lengths})
