"""How large motions and torques typically are: what makes a size of an effect 'small'."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arm.arm import Arm
from ..arm.chord import deflection_rows
from ..trajectory import Trajectory

FLOOR = 1e-12
"""Keeps a size positive where nothing moves."""

FRICTION_SHARE = 0.1
"""Of the typical torque, at the typical speed: friction and drag to begin with."""
DISTURBANCE_SHARE = 0.05
"""Of the typical torque: what is added to it, to begin with."""


@dataclass(frozen=True)
class Sizes:
    """Root mean squares over the recordings, per joint (joints,) unless said otherwise."""

    torque: np.ndarray
    """N m (N)"""
    peak_torque: np.ndarray
    speed: np.ndarray
    """rad/s (m/s)"""
    travel: np.ndarray
    """rad (m): the longest range of the joint's position within a recording"""
    span: np.ndarray
    """rad (m): the range over all recordings"""
    deflection: np.ndarray
    """m: of each segment's end beside its root's direction"""
    tip_speed: float
    """m/s"""
    sample_time: float
    """s"""


def typical(arm: Arm) -> Sizes:
    """Guesses for an arm of which no motion is known."""
    ones = np.ones(arm.joints)
    return Sizes(
        5.0 * ones, 20.0 * ones, 0.3 * ones, 0.2 * ones, 0.2 * ones, 2e-3 * ones, 0.2, 1e-3
    )


def sizes_of(motions: Sequence[Trajectory]) -> Sizes:
    """What some simulated motions of one arm show."""
    arm, p = motions[0].arm, motions[0].p
    joints = arm.joints
    torque = np.vstack([m.torque for m in motions])
    speed = np.vstack([m.v[:, :joints] for m in motions])
    travel = np.max([np.ptp(m.q[:, :joints], axis=0) for m in motions], axis=0)
    places = np.vstack([m.q[:, :joints] for m in motions])
    bent = np.vstack([m.q @ deflection_rows(arm, p).T for m in motions])
    tips = np.vstack([m.tip()[1] for m in motions])
    return Sizes(
        torque=np.sqrt(np.mean(torque**2, axis=0)) + FLOOR,
        peak_torque=np.abs(torque).max(axis=0) + FLOOR,
        speed=np.sqrt(np.mean(speed**2, axis=0)) + FLOOR,
        travel=travel + FLOOR,
        span=np.ptp(places, axis=0) + FLOOR,
        deflection=np.sqrt(np.mean(bent**2, axis=0)) + FLOOR,
        tip_speed=float(np.sqrt(np.mean(np.sum(tips**2, axis=1)))) + FLOOR,
        sample_time=float(motions[0].time[1] - motions[0].time[0]),
    )
