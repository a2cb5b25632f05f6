"""Encoders behind the gear, on the link."""

from typing import ClassVar

import numpy as np

from ..arm.arm import Arm
from ..arm.joints import joint
from ..drives.law import DriveLaw
from ..recording.channels import ChannelKind
from ..sensors.sensor import Channel, OutputRows, Sensor, rows_of
from ..trajectory import Trajectory


def link_rows(arm: Arm) -> np.ndarray:
    """(joints, n): position of each segment's root, behind the joint's twist if it has one."""
    rows = np.eye(arm.joints, arm.coordinates)
    for k in range(arm.joints):
        place = arm.twist_place(k)
        if place is not None:
            rows[k, place] = 1.0
    return rows


class LinkEncoder(Sensor):
    """Position of each joint on the side of the link: with an elastic joint the twist is in it."""

    kind = "link_encoder"
    drifts = True
    title = "link-side encoders"
    noise = "link_encoder_noise"
    letter, called = "l", "link-side encoder"
    primary = True
    optional = True
    columns: ClassVar[tuple[ChannelKind, ...]] = (
        ChannelKind("link_theta#", "123", ("rad", "m"), "link-side position", sparse=True),
    )

    def is_stated(self, arm: Arm) -> bool:
        return any(arm.elastic)  # else it is a sensor that is there already

    def channels(self, arm: Arm) -> tuple[Channel, ...]:
        units = [joint(s.joint).coordinate_unit for s in arm.segments]
        return tuple(Channel(f"link_theta{k + 1}", unit) for k, unit in enumerate(units))

    def measure(self, trajectory: Trajectory) -> np.ndarray:
        return trajectory.q @ link_rows(trajectory.arm).T

    def rows(self, arm: Arm, p: np.ndarray, law: DriveLaw) -> OutputRows:
        rows = rows_of(arm, law, arm.joints)
        rows.Q[:, :] = link_rows(arm)
        return rows
