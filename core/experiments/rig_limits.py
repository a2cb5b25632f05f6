"""Limits of the rig per joint, and the share that a motion uses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..scenario.rig_spec import LimitsSpec
from ..trajectory import Trajectory


@dataclass(frozen=True)
class RigLimits:
    """Limits of positions, speeds and torques per joint, and of the tip's place."""

    position: np.ndarray
    """(joints, 2) rad or m: lowest, highest."""
    speed: np.ndarray
    """(joints,) rad/s or m/s"""
    torque: np.ndarray
    """(joints,) N m or N"""
    reach: np.ndarray
    """(2, 2) m: lowest and highest z1, z2; infinite where nothing is stated."""

    def usage(
        self, motion: Trajectory, doubt: np.ndarray | float = 0.0
    ) -> tuple[np.ndarray, float]:
        """((joints,) share of each joint's tightest limit, share of the tip's); above 1 a limit is
        violated. Positions count from the start. `doubt` (joints,): share by which the motion may
        be larger than the model's."""
        joints = motion.arm.joints
        place, speed = motion.q[:, :joints], motion.v[:, :joints]
        shares = [
            (1.0 + doubt) * np.max(_share(place, *self.position.T), axis=0),
            (1.0 + doubt) * np.abs(speed).max(axis=0) / self.speed,
            np.abs(motion.torque).max(axis=0) / self.torque,
        ]
        tip = float(np.max(_share(motion.tip()[0], *self.reach.T)))
        return np.max(shares, axis=0), (1.0 + float(np.max(doubt))) * tip


def _share(place: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(N, k) share of the way from the first position to the bound ahead."""
    start = place[0]
    up, down = place - start, start - place
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = np.maximum(up / (high - start), down / (start - low))
    outside = (start < low) | (start > high)
    return np.asarray(np.where(outside, np.inf, np.nan_to_num(shares, nan=0.0, posinf=np.inf)))


def rig_limits(spec: LimitsSpec, motions: Sequence[Trajectory]) -> RigLimits:
    """The limits that `[limits]` states; default: the range of the model's `motions` along the
    recordings. InputError for a list with another length than the arm has joints."""
    joints = motions[0].arm.joints
    places = np.concatenate([m.q[:, :joints] for m in motions])
    speeds = np.concatenate([m.v[:, :joints] for m in motions])
    torques = np.concatenate([m.torque for m in motions])
    ranges = np.stack([places.min(axis=0), places.max(axis=0)], axis=1)
    reach = ((-np.inf, np.inf), (-np.inf, np.inf)) if spec.reach is None else spec.reach
    return RigLimits(
        position=_each("position", spec.position, joints, ranges),
        speed=_each("speed", spec.speed, joints, np.abs(speeds).max(axis=0)),
        torque=_each("torque", spec.torque, joints, np.abs(torques).max(axis=0)),
        reach=np.array(reach, dtype=float),
    )


def _each(name: str, stated: Sequence[object] | None, joints: int, used: np.ndarray) -> np.ndarray:
    """One row per joint."""
    if stated is None:
        return used
    if len(stated) not in (1, joints):
        raise InputError(
            f"[limits] {name} has {len(stated)} entries; the arm has {joints} joints: give one for "
            "all of them, or one each."
        )
    rows = list(stated) * joints if len(stated) == 1 else list(stated)
    return np.array(rows, dtype=float)
