"""Joint angles (8-9) and velocities (12) of the paper: those of the fictitious rigid arm with the
same tip."""

from __future__ import annotations

import numpy as np

from core.arm.arm import Arm
from core.arm.chord import (
    require_regular,
    require_two_revolute,
    rigid_angle_matrix,
    rigid_angles,
    rigid_rates,
)
from core.arm.compiled import CompiledArm
from core.arm.slots import LENGTH, arm_vector, slot
from core.drives.law import DriveLaw
from core.recording.recording import Recording
from core.recording.velocity import central_difference
from core.sensors.sensor import Channel, OutputRows, Sensor, rows_of
from core.trajectory import Trajectory


def lengths(p: np.ndarray) -> tuple[float, float]:
    """l1 and l2 in m."""
    return float(p[slot(0, LENGTH)]), float(p[slot(1, LENGTH)])


class RigidAngles(Sensor):
    """y with g(y) = z, the encoders telling the elbow's side; C1 q in the linear model."""

    kind = "y"
    drifts = True
    title = "angles of the fictitious rigid arm"
    from_camera = True
    slow = True

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


class RigidRates(RigidAngles):
    """ybar = J(y)^-1 z' with the rigid arm's own angles y: stable, while y integrates.

    The paper takes J at the encoders' angles; at the tip's own angles the linear model fits the
    non-linear one better, because the deflection no longer enters J (worst of 50 seeds with the
    default excitation: 99.5 % against 97.4 %).

    A recording without ydot1 and ydot2 gives them from its sampled tip places by central
    differences; [identify] filter then acts on measurement and model alike.
    """

    kind = "ydot"
    drifts = False
    title = "velocities of the fictitious rigid arm"
    noise = "rates_noise"

    def channels(self, arm: Arm) -> tuple[Channel, ...]:
        return Channel("ydot1", "rad/s"), Channel("ydot2", "rad/s")

    def measure(self, trajectory: Trajectory) -> np.ndarray:
        if trajectory.linear:
            return trajectory.v @ rigid_angle_matrix(trajectory.arm, trajectory.p).T
        z, speed = trajectory.tip()
        l1, l2 = lengths(trajectory.p)
        return rigid_rates(rigid_angles(trajectory.joint_positions, z, l1, l2), speed, l1, l2)

    def rows(self, arm: Arm, p: np.ndarray, law: DriveLaw) -> OutputRows:
        rows = rows_of(arm, law, 2)
        rows.V[:, :] = rigid_angle_matrix(arm, p)
        return rows

    def measured(self, recording: Recording, arm: Arm) -> np.ndarray:
        if self.direct(recording, arm):
            return np.column_stack([recording["ydot1"], recording["ydot2"]])
        theta = np.column_stack([recording["theta1"], recording["theta2"]])
        z = np.column_stack([recording["z1"], recording["z2"]])
        return _sampled_rates(theta, z, recording.sample_time, arm_vector(arm))

    def measure_like(self, recording: Recording, trajectory: Trajectory) -> np.ndarray:
        if self.direct(recording, trajectory.arm):
            return self.measure(trajectory)
        dt = recording.sample_time
        if trajectory.linear:
            y = trajectory.q @ rigid_angle_matrix(trajectory.arm, trajectory.p).T
            return np.column_stack([central_difference(column, dt) for column in y.T])
        z = trajectory.tip()[0]
        return _sampled_rates(trajectory.joint_positions, z, dt, trajectory.p)

    def linear_rows(
        self, recording: Recording, arm: Arm, p: np.ndarray, law: DriveLaw
    ) -> OutputRows | None:
        route = self.rows if self.direct(recording, arm) else super().rows
        return route(arm, p, law)

    def from_linear(
        self, y: np.ndarray, recording: Recording, arm: Arm, compiled: CompiledArm, p: np.ndarray
    ) -> np.ndarray:
        if self.is_linear(recording, arm):
            return y
        return np.asarray(np.gradient(y, recording.sample_time, axis=0))

    def is_linear(self, recording: Recording, arm: Arm) -> bool:
        return self.direct(recording, arm)


def _sampled_rates(theta: np.ndarray, z: np.ndarray, dt: float, p: np.ndarray) -> np.ndarray:
    """(N, 2) from sampled joint angles and tip places."""
    l1, l2 = lengths(p)
    y = rigid_angles(theta, z, l1, l2)
    return np.column_stack([central_difference(column, dt) for column in y.T])
