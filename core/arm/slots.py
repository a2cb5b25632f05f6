"""The numeric vector p that the compiled equations of an arm take.

Eight slots per segment, then the two components of gravity. Structure (joints, modes, mounts)
is compiled in; everything here may change without a new compilation.
"""

from __future__ import annotations

import numpy as np

from core.arm.arm import Arm

LENGTH, MASS, STIFFNESS, DAMPING_TIME, TIP_MASS, TIP_INERTIA, HUB_INERTIA, AXIS_ANGLE = range(8)
PER_SEGMENT = 8


def slot(segment: int, which: int) -> int:
    """Index in p of a quantity of a segment (from 0)."""
    return PER_SEGMENT * segment + which


def gravity_slot(joints: int, component: int) -> int:
    """Index in p of a component of gravity (from 0)."""
    return PER_SEGMENT * joints + component


def slot_count(joints: int) -> int:
    """Length of p."""
    return PER_SEGMENT * joints + 2


def arm_vector(arm: Arm) -> np.ndarray:
    """p (8 N + 2,) in SI units for an arm as described."""
    rows = [
        [
            s.length,
            s.mass,
            s.bending_stiffness,
            s.damping_time,
            s.tip_mass,
            s.tip_inertia,
            s.hub_inertia,
            s.axis_angle,
        ]
        for s in arm.segments
    ]
    return np.array([value for row in rows for value in row] + list(arm.gravity), dtype=float)
