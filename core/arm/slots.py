"""The numeric vector p that the compiled equations of an arm take.

Thirteen slots per segment, then the two components of gravity, the stiffness of the base, and the
stiffness and inertia of a pedestal. Structure (joints, modes, mounts) is compiled in; everything
here may change without a new compilation.
"""

from __future__ import annotations

import numpy as np

from ..arm.arm import Arm

LENGTH, MASS, STIFFNESS, DAMPING_TIME, TIP_MASS, TIP_INERTIA, HUB_INERTIA, AXIS_ANGLE = range(8)
TWIST_STIFFNESS = 8
"""N m/rad (N/m) of an elastic joint; zero where the joint is rigid."""
ROTOR_INERTIA = 9
"""kg m^2 of a rotor that turns with the segment that carries it as well."""
CENTRE_ALONG, CENTRE_ACROSS, INERTIA = 10, 11, 12
"""m, m and kg m^2: centre of mass and inertia about it; the equations of a bending segment, whose
mass is spread evenly, have none of them."""
PER_SEGMENT = 13

WEIGHING = [
    LENGTH, MASS, TIP_MASS, TIP_INERTIA, HUB_INERTIA, AXIS_ANGLE, ROTOR_INERTIA,
    CENTRE_ALONG, CENTRE_ACROSS, INERTIA,
]  # fmt: skip
"""Of a segment's slots, those that the mass matrix depends on."""


def slot(segment: int, which: int) -> int:
    """Index in p of a quantity of a segment (from 0)."""
    return PER_SEGMENT * segment + which


def weighing(p: np.ndarray, joints: int) -> np.ndarray:
    """(10 N + 1,) entries of p (13 N + 5,) that the mass matrix depends on; springs, dampers and
    gravity are not."""
    own = p[: PER_SEGMENT * joints].reshape(joints, PER_SEGMENT)[:, WEIGHING].ravel()
    return np.append(own, p[pedestal_slots(joints)[1]])


def gravity_slot(joints: int, component: int) -> int:
    """Index in p of a component of gravity (from 0)."""
    return PER_SEGMENT * joints + component


def base_slot(joints: int) -> int:
    """Index in p of the stiffness of the base, N/m; zero where the base is rigid."""
    return PER_SEGMENT * joints + 2


def pedestal_slots(joints: int) -> tuple[int, int]:
    """Indices in p of the stiffness, N m/rad, and the inertia, kg m^2, of a pedestal; both zero
    where the base does not turn."""
    return PER_SEGMENT * joints + 3, PER_SEGMENT * joints + 4


def _stiffness(compliance: float | None) -> float:
    return 0.0 if compliance is None else 1.0 / compliance


def arm_vector(arm: Arm) -> np.ndarray:
    """p (13 N + 5,) in SI units for an arm as described."""
    rows = (
        (
            s.length, s.mass, s.bending_stiffness, s.damping_time, s.tip_mass, s.tip_inertia,
            s.hub_inertia, s.axis_angle, _stiffness(s.joint_compliance), s.rotor_inertia,
            *s.centre, s.central_inertia,
        )
        for s in arm.segments
    )  # fmt: skip
    flat = (value for row in rows for value in row)
    pedestal = arm.pedestal
    turning = (1.0 / pedestal.compliance, pedestal.inertia) if pedestal else (0.0, 0.0)
    return np.array([*flat, *arm.gravity, _stiffness(arm.base_compliance), *turning], dtype=float)
