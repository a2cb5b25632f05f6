"""Joint encoders."""

import numpy as np

from ..arm.arm import Arm
from ..arm.joints import joint
from ..drives.law import DriveLaw
from ..sensors.sensor import Channel, OutputRows, Sensor, rows_of
from ..trajectory import Trajectory


class Encoder(Sensor):
    """Position of each joint."""

    kind = "encoder"
    drifts = True
    title = "joint encoders"
    noise = "encoder_noise"
    letter, called = "e", "encoder"
    primary = True

    def channels(self, arm: Arm) -> tuple[Channel, ...]:
        units = [joint(s.joint).coordinate_unit for s in arm.segments]
        return tuple(Channel(f"theta{k + 1}", unit) for k, unit in enumerate(units))

    def measure(self, trajectory: Trajectory) -> np.ndarray:
        return trajectory.joint_positions

    def rows(self, arm: Arm, p: np.ndarray, law: DriveLaw) -> OutputRows:
        rows = rows_of(arm, law, arm.joints)
        rows.Q[:, : arm.joints] = np.eye(arm.joints)
        return rows
