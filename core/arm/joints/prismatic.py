"""A joint that slides."""

from __future__ import annotations

from typing import TYPE_CHECKING

from core.arm.joints.joint import Joint, Placement

if TYPE_CHECKING:
    import sympy as sp


class Prismatic(Joint):
    """Moves its segment by the joint coordinate in m along a direction fixed before the joint."""

    kind = "prismatic"
    coordinate_unit = "m"
    effort_unit = "N"
    inertia_unit = "kg"

    def place(self, coordinate: sp.Symbol, axis_angle: sp.Symbol) -> Placement:
        import sympy as sp

        return Placement(turn=sp.Integer(0), slide=coordinate, direction=axis_angle)
