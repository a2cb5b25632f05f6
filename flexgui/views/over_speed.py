"""The torque of effects on a joint over the joint's speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexgui.core.arm.arm import Arm
from flexgui.core.effects.effect import Effect, Values
from flexgui.core.effects.per_joint import joint_direction
from flexgui.core.forces.element import Element

POINTS_OVER_SPEED = 401
"""Of a line; odd, so that it has one at rest."""


@dataclass(frozen=True)
class OverSpeed:
    """Torque over speed of one joint."""

    joint: int
    """From 1."""
    speed: np.ndarray
    """(N,) rad/s or m/s"""
    torque: np.ndarray
    """(N,) N m or N, as it acts on the joint"""
    line: bool
    """Whether the speed alone says it; otherwise N samples of a motion."""


def over_speed(
    effects: Sequence[Effect], arm: Arm, p: np.ndarray, values: Values,
    place: np.ndarray, speed: np.ndarray,
) -> tuple[OverSpeed, ...]:  # fmt: skip
    """Along a motion with joint positions `place` (M, joints) and speeds `speed` (M, joints) of an
    arm with numbers p (np,).

    Empty where an effect is no force law at a joint, or one with a memory: dry friction is at the
    level on which it slides.
    """
    elements = [e for effect in effects for e in effect.elements(arm, p, values)]
    if not elements or not all(_known(e, arm) for e in elements):
        return ()
    laws = []
    for k in range(arm.joints):
        own = [e for e in elements if _at(e, arm, k)]
        line = not any(set(e.law.x) & e.law.forces[0].free_symbols for e in own)
        x, v = place[:, k], speed[:, k]
        if line:
            v = np.linspace(v.min(), v.max(), POINTS_OVER_SPEED)
            x = np.zeros(POINTS_OVER_SPEED)
        torque = sum((_torque(e, x, v) for e in own), np.zeros(len(v)))
        laws.append(OverSpeed(k + 1, v, torque, line))
    return tuple(laws)


def _known(e: Element, arm: Arm) -> bool:
    remembers = bool(e.law.states) and not e.law.bristle
    return not remembers and any(_at(e, arm, k) for k in range(arm.joints))


def _at(e: Element, arm: Arm, k: int) -> bool:
    """Whether the element acts on joint k (from 0) only."""
    alone = len(e.law.x) == 1 and not e.at_tip
    return alone and np.array_equal(e.directions[0], joint_direction(arm, k))


def _torque(e: Element, x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """(N,) torque; a sliding bristle is fully bent in the direction of motion."""
    from flexgui.core.forces.compiled import compile_law

    compiled, values = compile_law(e.law), np.array(e.values, dtype=float)
    w = np.sign(v)[:, None] if e.law.bristle else np.zeros((len(v), 0))
    forces = [compiled(x[i : i + 1], v[i : i + 1], w[i], values)[0] for i in range(len(v))]
    return np.array(forces)
