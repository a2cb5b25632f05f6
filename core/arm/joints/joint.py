"""What a joint does to the frame of the segment that it carries."""

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
    inertia_unit = ""

    @abstractmethod
    def place(self, coordinate: sp.Symbol, axis_angle: sp.Symbol) -> Placement:
        """The placement as a function of the joint's coordinate."""
