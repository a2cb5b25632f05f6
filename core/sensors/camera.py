"""The tip camera: the place of the end effector."""

import numpy as np

from core.arm.arm import Arm
from core.sensors.sensor import Channel, Sensor
from core.trajectory import Trajectory


class Camera(Sensor):
    """Place z of the end effector in the plane, (3) of the paper."""

    kind = "z"
    title = "tip camera"

    def channels(self, arm: Arm) -> tuple[Channel, ...]:
        return Channel("z1", "m"), Channel("z2", "m")

    def measure(self, trajectory: Trajectory) -> np.ndarray:
        return trajectory.tip()[0]
