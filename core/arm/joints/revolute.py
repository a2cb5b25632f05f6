"""A joint that turns."""

from __future__ import annotations

from typing import TYPE_CHECKING

from core.arm.joints.joint import Joint, Placement

if TYPE_CHECKING:
    import sympy as sp


class Revolute(Joint):
    """Turns its segment by the joint coordinate in rad."""

    kind = "revolute"
    coordinate_unit = "rad"
    effort_unit = "N m"
    inertia_unit = "kg m²"

    def place(self, coordinate: sp.Symbol, axis_angle: sp.Symbol) -> Placement:
        import sympy as sp

        return Placement(turn=coordinate, slide=sp.Integer(0), direction=sp.Integer(0))
