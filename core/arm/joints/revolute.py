"""A joint that turns."""

import sympy as sp

from core.arm.joints.joint import Joint, Placement


class Revolute(Joint):
    """Turns its segment by the joint coordinate in rad."""

    kind = "revolute"
    coordinate_unit = "rad"
    effort_unit = "N m"
    inertia_unit = "kg m²"

    def place(self, coordinate: sp.Symbol, axis_angle: sp.Symbol) -> Placement:
        return Placement(turn=coordinate, slide=sp.Integer(0), direction=sp.Integer(0))
