"""Where every point of an arm is: the one statement that everything else follows from.

A place in the plane is a sum of phasors, p = sum_a exp(i phi_a) w_a(v, x), with angles phi_a
linear in q. Real part: first component, imaginary part: second. Design section 2, (3).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import sympy as sp

from ..arm import shapes
from ..arm.arm import Structure
from ..arm.joints import joint
from ..arm.slots import AXIS_ANGLE, CENTRE_ACROSS, CENTRE_ALONG, LENGTH
from ..arm.symbols import Symbols


@dataclass(frozen=True)
class Phasor:
    """exp(i angle) (along + i across): a vector given in a frame turned by `angle`."""

    angle: sp.Expr
    along: sp.Expr
    across: sp.Expr


Place = tuple[Phasor, ...]


def components(place: Place) -> sp.Matrix:
    """The place (2, 1) in the plane."""
    first = [f.along * sp.cos(f.angle) - f.across * sp.sin(f.angle) for f in place]
    second = [f.along * sp.sin(f.angle) + f.across * sp.cos(f.angle) for f in place]
    return sp.Matrix([sp.Add(*first), sp.Add(*second)])


@dataclass(frozen=True)
class Kinematics:
    """Places and directions along the segments of one structure."""

    structure: Structure

    @cached_property
    def symbols(self) -> Symbols:
        """The symbols of this structure."""
        return Symbols(self.structure)

    @cached_property
    def _bases(self) -> tuple[tuple[Place, sp.Expr], ...]:
        """(place, angle) of each segment's root, and last of the arm's tip."""
        bases: list[tuple[Place, sp.Expr]] = []
        place: Place = self._ground
        angle: sp.Expr = self.symbols.pedestal
        for k in range(self.structure.segments):
            if self.structure.mounts[k] == "ground":
                place, angle = self._ground, self.symbols.pedestal
            kind = joint(self.structure.joints[k])
            moved = self.symbols.theta[k] + self.symbols.twist[k]
            shift = kind.place(moved, self.symbols.slot(k, AXIS_ANGLE))
            if shift.slide != 0:
                place = (*place, Phasor(angle + shift.direction, shift.slide, sp.Integer(0)))
            angle = angle + shift.turn
            bases.append((place, angle))
            length = self.symbols.slot(k, LENGTH)
            place = (*place, self._along(k, length, angle))
            angle = angle + shapes.slope(self.symbols.modal[k], length)
        bases.append((place, angle))
        return tuple(bases)

    @property
    def _ground(self) -> Place:
        """Where the base stands."""
        if not self.symbols.base:
            return ()
        return (Phasor(sp.Integer(0), *self.symbols.base),)

    def _along(self, segment: int, x: sp.Expr, angle: sp.Expr) -> Phasor:
        v = self.symbols.modal[segment]
        return Phasor(angle, x + shapes.foreshortening(v, x), shapes.deflection(v, x))

    def root(self, segment: int) -> tuple[Place, sp.Expr]:
        """Place and direction (rad) of a segment's root."""
        return self._bases[segment]

    def point(self, segment: int, x: sp.Expr) -> Place:
        """The place at distance x from the root of a segment."""
        base, angle = self._bases[segment]
        return (*base, self._along(segment, x, angle))

    def centre(self, segment: int) -> Place:
        """The centre of mass of a rigid segment, m."""
        base, angle = self._bases[segment]
        along, across = (self.symbols.slot(segment, w) for w in (CENTRE_ALONG, CENTRE_ACROSS))
        return (*base, Phasor(angle, along, across))

    def segment_tip(self, segment: int) -> Place:
        """Place of a segment's end (from 0), m."""
        return self.point(segment, self.symbols.slot(segment, LENGTH))

    def tip(self) -> Place:
        """The end effector, z."""
        return self.segment_tip(self.structure.segments - 1)

    def rotor_angle(self, segment: int) -> sp.Expr:
        """Direction (rad) of a rotor without a gear at a segment's joint; linear in q. It stands on
        the end of the segment before, and does not see the twist behind it."""
        alone = segment == 0 or self.structure.mounts[segment] == "ground"
        carried = self.symbols.pedestal if alone else self.tip_angle(segment - 1)
        shift = joint(self.structure.joints[segment]).place(
            self.symbols.theta[segment], self.symbols.slot(segment, AXIS_ANGLE)
        )
        return carried + shift.turn

    def tip_angle(self, segment: int) -> sp.Expr:
        """Direction of the end of a segment, rad; linear in q."""
        angle = self._bases[segment][1]
        length = self.symbols.slot(segment, LENGTH)
        return angle + shapes.slope(self.symbols.modal[segment], length)
