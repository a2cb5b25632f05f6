"""What a joint does to the frame of the segment that it carries, and the two common kinds."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import sympy as sp


class Placement(NamedTuple):
    """Where a joint puts its segment, relative to the end of the segment before.

    `turn` is added to the frame's angle; the base moves by `slide` along the direction
    (angle of the frame before + `direction`).
    """

    turn: sp.Expr
    slide: sp.Expr
    direction: sp.Expr


class Joint(ABC):
    """A kind of joint."""

    kind = ""
    coordinate_unit = ""
    effort_unit = ""
    effort = ""
    """What drives it, in a word."""
    inertia_unit = ""

    @property
    def damping_unit(self) -> str:
        """Of what brakes the joint in proportion to its speed."""
        return f"{self.effort_unit} s/{self.coordinate_unit}"

    @property
    def compliance_unit(self) -> str:
        """Of how far the joint gives way."""
        return f"{self.coordinate_unit}/({self.effort_unit})"

    @abstractmethod
    def place(self, coordinate: sp.Symbol, axis_angle: sp.Symbol) -> Placement:
        """The placement as a function of the joint's coordinate."""


class Revolute(Joint):
    """Turns its segment by the joint coordinate in rad."""

    kind = "revolute"
    coordinate_unit = "rad"
    effort_unit = "N m"
    effort = "torque"
    inertia_unit = "kg m²"

    def place(self, coordinate: sp.Symbol, axis_angle: sp.Symbol) -> Placement:
        import sympy as sp

        return Placement(turn=coordinate, slide=sp.Integer(0), direction=sp.Integer(0))


class Prismatic(Joint):
    """Moves its segment by the joint coordinate in m along a direction fixed before the joint."""

    kind = "prismatic"
    coordinate_unit = "m"
    effort_unit = "N"
    effort = "force"
    inertia_unit = "kg"

    def place(self, coordinate: sp.Symbol, axis_angle: sp.Symbol) -> Placement:
        import sympy as sp

        return Placement(turn=sp.Integer(0), slide=coordinate, direction=axis_angle)
