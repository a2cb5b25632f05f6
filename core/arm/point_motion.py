"""Motion of a point on a link, from the symbols that the equations of motion come from."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from ..arm.arm import Arm, Structure
from ..arm.slots import gravity_slot

STEP = 1e-4
"""s: of the second difference along a motion of constant acceleration. Its error is below 1e-5 of
an acceleration where joints turn by 10 rad/s, and rounding gives 1e-8 m/s^2."""


class Motion(NamedTuple):
    """Coordinates, their rates and their accelerations, (N, n) each."""

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray

    def after(self, seconds: float) -> np.ndarray:
        """(N, n): where each sample's motion leads with its acceleration unchanged."""
        return self.q + seconds * self.v + 0.5 * seconds**2 * self.a


@lru_cache(maxsize=64)
def _functions(structure: Structure, segment: int) -> tuple[Callable[..., Any], ...]:
    """Place (2,) of the point at x on a segment, from (q, p, x), and the slopes (n,) in q of the
    link's direction and of its curvature there, from (p, x)."""
    import sympy as sp

    from ..arm import shapes
    from ..arm.kinematics import Kinematics, components

    kinematics = Kinematics(structure)
    s = kinematics.symbols
    direction = kinematics.root(segment)[1] + shapes.slope(s.modal[segment], s.x)
    place = list(components(kinematics.point(segment, s.x)))
    linear = (direction, shapes.curvature(s.modal[segment], s.x))
    return (
        sp.lambdify([*s.q, *s.p, s.x], place, "numpy", cse=True),
        *(sp.lambdify([*s.p, s.x], [sp.diff(y, q) for q in s.q], "numpy") for y in linear),
    )


def direction_row(arm: Arm, p: np.ndarray, segment: int, x: float) -> np.ndarray:
    """(n,): the direction of a segment (from 0) at `x` m from its joint, rad, is this row times q;
    p (13 N + 5,) are the arm's numbers."""
    return np.array(_functions(Structure.of(arm), segment)[1](*p, x), dtype=float)


def curvature_row(arm: Arm, p: np.ndarray, segment: int, x: float) -> np.ndarray:
    """(n,): the curvature of a segment (from 0) at `x` m from its joint, 1/m, is this row times q;
    p (13 N + 5,) are the arm's numbers."""
    return np.array(_functions(Structure.of(arm), segment)[2](*p, x), dtype=float)


def place_of(arm: Arm, p: np.ndarray, q: np.ndarray, segment: int, x: float) -> np.ndarray:
    """(N, 2) m: the point at `x` m on a segment (from 0) at postures q (N, n)."""
    place = _functions(Structure.of(arm), segment)[0](*q.T, *p, x)
    return np.column_stack([np.broadcast_to(part, len(q)) for part in place])


def normal_acceleration(
    arm: Arm, p: np.ndarray, motion: Motion, segment: int, x: float
) -> np.ndarray:
    """(N,) m/s²: what an accelerometer at `x` m on a segment (from 0) reads along the link's
    normal: its acceleration minus gravity."""
    ahead, here, behind = (
        place_of(arm, p, motion.after(seconds), segment, x) for seconds in (STEP, 0.0, -STEP)
    )
    gravity = [p[gravity_slot(arm.joints, i)] for i in range(2)]
    force = (ahead - 2.0 * here + behind) / STEP**2 - gravity
    angle = motion.q @ direction_row(arm, p, segment, x)
    return np.asarray(force[:, 1] * np.cos(angle) - force[:, 0] * np.sin(angle))
