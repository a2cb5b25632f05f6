"""Joint angles of the fictitious rigid arm with the same tip, (8-9) of the paper."""

import numpy as np

from core.arm.arm import Arm
from core.arm.chord import (
    require_regular,
    require_two_revolute,
    rigid_angle_matrix,
    rigid_angles,
)
from core.arm.slots import LENGTH, arm_vector, slot
from core.drives.law import DriveLaw
from core.recording.recording import Recording
from core.sensors.sensor import Channel, OutputRows, Sensor, rows_of
from core.trajectory import Trajectory


def lengths(p: np.ndarray) -> tuple[float, float]:
    """l1 and l2 in m."""
    return float(p[slot(0, LENGTH)]), float(p[slot(1, LENGTH)])


class RigidAngles(Sensor):
    """y with g(y) = z, the encoders telling the elbow's side; C1 q in the linear model."""

    kind = "y"
    title = "angles of the fictitious rigid arm"
    from_camera = True

    def defined_on(self, arm: Arm) -> bool:
        return arm.two_revolute

    def channels(self, arm: Arm) -> tuple[Channel, ...]:
        return Channel("y1", "rad"), Channel("y2", "rad")

    def check(self, arm: Arm, recording: Recording) -> None:
        require_two_revolute(arm)
        if recording.has("theta2"):
            require_regular(recording["theta2"], recording.name)

    def measure(self, trajectory: Trajectory) -> np.ndarray:
        if trajectory.linear:
            return trajectory.q @ rigid_angle_matrix(trajectory.arm, trajectory.p).T
        z = trajectory.tip()[0]
        return rigid_angles(trajectory.joint_positions, z, *lengths(trajectory.p))

    def rows(self, arm: Arm, p: np.ndarray, law: DriveLaw) -> OutputRows:
        rows = rows_of(arm, law, 2)
        rows.Q[:, :] = rigid_angle_matrix(arm, p)
        return rows

    def measured(self, recording: Recording, arm: Arm) -> np.ndarray:
        if recording.has("y1", "y2"):
            return super().measured(recording, arm)
        theta = np.column_stack([recording["theta1"], recording["theta2"]])
        z = np.column_stack([recording["z1"], recording["z2"]])
        return rigid_angles(theta, z, *lengths(arm_vector(arm)))

    def available(self, recording: Recording, arm: Arm) -> bool:
        from_camera = recording.has("theta1", "theta2", "z1", "z2")
        return arm.two_revolute and (from_camera or super().available(recording, arm))
