"""The torque of the motors."""

import numpy as np

from ..arm.arm import Arm
from ..arm.joints import joint
from ..drives.law import DriveLaw
from ..sensors.sensor import Channel, OutputRows, Sensor
from ..trajectory import Trajectory


class MotorTorque(Sensor):
    """Torque (force on a slide) that the drive applies at each joint."""

    kind = "torque"
    title = "motor torque"
    noise = "torque_noise"
    letter, called = "u", "the measured torque of motor"

    def channels(self, arm: Arm) -> tuple[Channel, ...]:
        units = [joint(s.joint).effort_unit for s in arm.segments]
        return tuple(Channel(f"u{k + 1}", unit) for k, unit in enumerate(units))

    def measure(self, trajectory: Trajectory) -> np.ndarray:
        return trajectory.torque

    def rows(self, arm: Arm, p: np.ndarray, law: DriveLaw) -> OutputRows:
        return OutputRows(-law.P, -law.V, -law.S, law.R)
