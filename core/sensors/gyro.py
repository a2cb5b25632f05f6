"""Gyroscopes on links."""

import numpy as np

from ..arm.arm import Arm
from ..arm.point_motion import direction_row
from ..drives.law import DriveLaw
from ..sensors.link_sensor import LinkSensor, families
from ..sensors.sensor import OutputRows, rows_of
from ..trajectory import Trajectory


class Gyro(LinkSensor):
    """Rate at which a link turns at a place: that of its joints and of its bending there."""

    kind = "gyro"
    title = "gyroscopes"
    noise = "gyro_noise"
    letter, called = "w", "gyroscope"
    unit = "rad/s"
    columns = families("gyro", "rad/s", "rate of a link (gyroscope)")

    def _rows(self, arm: Arm, p: np.ndarray) -> np.ndarray:
        rows = [direction_row(arm, p, k, x) for k, x, _ in self.places(arm, p)]
        return np.array(rows).reshape(len(rows), arm.coordinates)

    def measure(self, trajectory: Trajectory) -> np.ndarray:
        return np.asarray(trajectory.v @ self._rows(trajectory.arm, trajectory.p).T)

    def rows(self, arm: Arm, p: np.ndarray, law: DriveLaw) -> OutputRows:
        rows = rows_of(arm, law, len(self.channels(arm)))
        rows.V[:, :] = self._rows(arm, p)
        return rows
