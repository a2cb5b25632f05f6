"""A joint that slides."""

import sympy as sp

from core.arm.joints.joint import Joint, Placement


class Prismatic(Joint):
    """Moves its segment by the joint coordinate in m along a direction fixed before the joint."""

    kind = "prismatic"
    coordinate_unit = "m"
    effort_unit = "N"
    inertia_unit = "kg"

    def place(self, coordinate: sp.Symbol, axis_angle: sp.Symbol) -> Placement:
        return Placement(turn=sp.Integer(0), slide=coordinate, direction=axis_angle)
