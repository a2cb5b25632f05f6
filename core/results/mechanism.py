"""The arm of an outcome in plain numbers, for programs that have equations of their own."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PresentEffect:
    """An effect that is in the model, with what it acts on."""

    kind: str
    """Its id."""
    title: str
    sizes: tuple[tuple[str, float, str], ...]
    """(name, value, unit) of its parameters; empty for an effect that is switched."""
    linear: bool
    """Whether it is in the matrices of the linear model (or could be: see `acts_on`)."""
    acts_on: str
    """'arm' (its parameters or its structure), 'drive', 'sensor', or the force that it is:
    'damping' (proportional to a joint's speed), 'dry' (constant against the motion), 'force'
    (any other)."""


@dataclass(frozen=True)
class Link:
    """One segment with the joint that carries it, in SI units."""

    length: float
    mass: float
    EI: float
    """N m^2; without a meaning where `modes` is 0 (rigid)."""
    modes: int
    damping_time: float
    """s, Kelvin-Voigt."""
    tip_mass: float
    tip_inertia: float
    joint: str
    """'revolute' or 'prismatic'."""
    axis_angle: float
    """rad, direction of a slide."""
    on_ground: bool
    """Whether it hangs on the ground instead of on the segment before."""
    hub_inertia: float
    joint_stiffness: float | None
    """N m/rad (N/m) between motor and segment; None: rigid."""
    joint_damping: float
    """N m s/rad (N s/m)."""
    dry_friction: float
    """N m (N), a constant level."""
    gain: float | None
    """N m s/rad (N s/m) of a pure velocity loop; None: another drive."""
    limit: float | None
    """N m (N), the largest torque of the drive; None: no limit."""


@dataclass(frozen=True)
class Mechanism:
    """The arm as it now stands, and the effects in it."""

    links: tuple[Link, ...]
    gravity: tuple[float, float]
    """m/s^2 in the plane of motion."""
    base_stiffness: float | None
    """N/m, the same in both directions; None: the base does not move."""
    frequencies: tuple[float, ...]
    """Hz of the first vibrations at `posture`, joints held, nothing damped; at most three."""
    posture: tuple[float, ...]
    """Joint positions at which `frequencies` hold, in rad (m)."""
    effects: tuple[PresentEffect, ...] = ()
