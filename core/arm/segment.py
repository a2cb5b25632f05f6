"""One segment of an arm with the joint that carries it."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from ..validation import Bounded, NonNegative, Positive, Stated

MAX_MODES = 3
CLAMPED = 1.8751**2
"""First eigenvalue of a clamped uniform beam, squared: omega = CLAMPED sqrt(EI / (m l^3))."""
_OF_RIGID = ("centre_of_mass", "centre_of_mass_across", "inertia")


def _of_an_arm(length: float) -> float:
    """ValueError for a length that only another unit explains."""
    if length > 100.0:
        raise ValueError(f"is {length:g} m; no segment is longer than 100 m. Is it in mm?")
    return length


class Segment(Stated):
    """A uniform beam, rigid (`modes = 0`) or bending in `modes` assumed shapes x^2, x^3, x^4.

    A rigid one may have another centre of mass and inertia. Bending stiffness is given as `EI` or
    as the square section's `width` d and `young_modulus` epsilon, EI = epsilon d^4 / 12. All values
    are SI.
    """

    length: Annotated[Positive, AfterValidator(_of_an_arm)]
    """m, 100 at most."""
    mass: Positive
    """kg"""
    width: Positive | None = None
    """m, of the square section; with young_modulus instead of EI."""
    young_modulus: Positive | None = None
    """Pa"""
    EI: Positive | None = None
    """N m², bending stiffness."""
    modes: Annotated[int, Field(ge=0, le=MAX_MODES)] = 1
    """Bending modes, 0 (rigid) to 3."""
    damping_time: NonNegative = 0.0
    """Kelvin-Voigt retardation time in s: the bending damping is this times the stiffness."""
    centre_of_mass: Bounded | None = None
    """m, of a rigid segment, from its joint along it; None: its middle."""
    centre_of_mass_across: Bounded = 0.0
    """m, of a rigid segment, to its left."""
    inertia: Positive | None = None
    """kg m², of a rigid segment about its centre of mass; None: m l² / 12."""
    tip_mass: NonNegative = 0.0
    """kg, at the end of the segment."""
    tip_inertia: NonNegative = 0.0
    """kg m²"""
    hub_inertia: NonNegative = 0.0
    """kg m^2 (kg on a slide), rotor and gear behind a high gear: turns with the joint's own
    rate."""
    rotor_inertia: NonNegative = 0.0
    """Rotor of a motor without a gear, kg m^2: it turns with the segment that carries it too."""
    joint: str = "revolute"
    """revolute or prismatic."""
    joint_compliance: Positive | None = None
    """rad/(N m) (m/N on a slide) of the gear between motor and segment; None: rigid. The motor
    carries the hub's inertia, the drive and the encoder."""
    axis_angle: Bounded = 0.0
    """Direction of a prismatic joint's slide in rad, from the end of the segment before."""
    mount: Literal["previous", "ground"] = "previous"
    """`ground` uncouples a segment from the one before it: its base does not move."""

    @model_validator(mode="after")
    def _check_distribution(self) -> Segment:
        stated = [
            name
            for name in _OF_RIGID
            if getattr(self, name) != type(self).model_fields[name].default
        ]
        if self.modes and stated:
            raise ValueError(
                f"{stated[0]} is for a rigid segment (modes = 0); the mass of a bending one is "
                "spread evenly, and what sits at its end is its tip_mass and tip_inertia"
            )
        return self

    @model_validator(mode="after")
    def _check_section(self) -> Segment:
        if self.EI is None and self.modes and (self.width is None or self.young_modulus is None):
            raise ValueError("a bending segment needs EI, or both width and young_modulus")
        if self.EI is not None and self.young_modulus is not None:
            raise ValueError("give either EI or width and young_modulus, not both")
        return self

    @model_validator(mode="after")
    def _check_stiffness(self) -> Segment:
        if self.modes and not 1e-3 < (hz := self.clamped_frequency / (2.0 * math.pi)) < 1e6:
            raise ValueError(
                f"bends at {hz:.2g} Hz by its EI of {self.bending_stiffness:.3g} N m², its mass "
                "and its length; no beam does. State EI in N m² (width in m, young_modulus in Pa), "
                "mass in kg and length in m, or modes = 0 for a rigid one"
            )
        return self

    @model_validator(mode="after")
    def _check_motor(self) -> Segment:
        if self.joint_compliance is not None and self.hub_inertia + self.rotor_inertia == 0.0:
            raise ValueError(
                "an elastic joint (joint_compliance) needs a hub_inertia above zero, or without a "
                "gear a rotor_inertia: its motor moves separately"
            )
        return self

    @property
    def has_section(self) -> bool:
        """Whether EI follows from a square section."""
        return self.EI is None and self.width is not None and self.young_modulus is not None

    @property
    def bending_stiffness(self) -> float:
        """EI in N m^2; zero where a rigid segment states none."""
        if self.EI is not None:
            return self.EI
        if self.width is not None and self.young_modulus is not None:
            return self.young_modulus * self.width**4 / 12.0
        return 0.0

    @property
    def clamped_frequency(self) -> float:
        """rad/s of the segment alone, clamped at its root: its first."""
        return CLAMPED * math.sqrt(self.bending_stiffness / (self.mass * self.length**3))

    @property
    def centre(self) -> tuple[float, float]:
        """Where the centre of mass lies, along and across, in m from the joint."""
        along = self.length / 2.0 if self.centre_of_mass is None else self.centre_of_mass
        return along, self.centre_of_mass_across

    @property
    def central_inertia(self) -> float:
        """kg m^2 about the centre of mass."""
        return self.mass * self.length**2 / 12.0 if self.inertia is None else self.inertia
