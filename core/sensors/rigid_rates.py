"""Joint angles (8-9) and velocities (12) of the paper: those of the fictitious rigid arm.

It has the same geometry and the same tip: z = g(y), solved for y in closed form; the encoders only
choose the elbow's side and the turn. The paper's y = theta + J(theta)^-1 (z - g(theta)) is its
first Newton step. For two revolute joints, to first order, y = C1 q with
    y1 = theta1 + delta1(l1)/l1,
    y2 = theta2 + delta1'(l1) - delta1(l1)/l1 + delta2(l2)/l2,
which is (9) of the paper for one mode: [[1, 0, l1, 0], [0, 1, l1, l2]].
"""

from __future__ import annotations

import numpy as np

from ..arm.arm import Arm
from ..arm.chord import chord_matrix, slope_matrix
from ..arm.compiled import CompiledArm
from ..arm.slots import LENGTH, arm_vector, slot
from ..drives.law import DriveLaw
from ..errors import InputError
from ..recording.recording import Recording
from ..recording.velocity import central_difference
from ..sensors.sensor import Channel, OutputRows, Sensor, rows_of
from ..trajectory import Trajectory

SINGULAR_MARGIN = 0.05
"""rad: closer than this to theta2 = 0 or pi the rigid arm's angles are not defined well enough."""


def lengths(p: np.ndarray) -> tuple[float, float]:
    """l1 and l2 in m, of the arm's numbers p (np,)."""
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


def rigid_angle_matrix(arm: Arm, p: np.ndarray) -> np.ndarray:
    """C1 (2, n), (9) of the paper, from the arm's numbers p (np,); for two revolute joints only."""
    require_two_revolute(arm)
    chord, slope = chord_matrix(arm, p), slope_matrix(arm, p)
    C1 = np.eye(2, arm.coordinates)
    C1[0] += chord[0]
    C1[1] += slope[0] - chord[0] + chord[1]
    for k in range(2):
        place = arm.twist_place(k)
        if place is not None:
            C1[k, place] = 1.0
    return C1


def require_two_revolute(arm: Arm) -> None:
    """InputError where the fictitious rigid arm is not defined."""
    if not arm.two_revolute:
        raise InputError(
            f"[identify] output 'y' or 'ydot' needs an arm with two revolute joints, and arm "
            f'{arm.name!r} has others; choose output = "z" instead.'
        )


def require_regular(theta2: np.ndarray, name: str) -> None:
    """InputError where theta2 (N,) comes too close to a stretched or folded arm."""
    nearest = np.pi * np.round(theta2 / np.pi)
    distance = np.abs(theta2 - nearest)
    worst = int(np.argmin(distance))
    if distance[worst] < SINGULAR_MARGIN:
        raise InputError(
            f"Recording {name}: theta2 comes within {distance[worst]:.3f} rad of "
            f"{'0' if nearest[worst] == 0 else 'pi'}, where y and ydot are singular; "
            f'choose [identify] output = "z" instead.'
        )


def rigid_jacobian(theta: np.ndarray, l1: float, l2: float) -> np.ndarray:
    """J (N, 2, 2) of the rigid arm, l1 and l2 in m, at joint angles theta (N, 2) in rad."""
    s1, c1 = np.sin(theta[:, 0]), np.cos(theta[:, 0])
    s12, c12 = np.sin(theta[:, 0] + theta[:, 1]), np.cos(theta[:, 0] + theta[:, 1])
    J = np.empty((len(theta), 2, 2))
    J[:, 0, 0], J[:, 0, 1] = -l1 * s1 - l2 * s12, -l2 * s12
    J[:, 1, 0], J[:, 1, 1] = l1 * c1 + l2 * c12, l2 * c12
    return J


def rigid_angles(theta: np.ndarray, z: np.ndarray, l1: float, l2: float) -> np.ndarray:
    """y (N, 2) in rad: angles of the rigid arm, l1 and l2 in m, with the tip z (N, 2) in m, on the
    side of theta (N, 2)."""
    cosine = (np.sum(z * z, axis=1) - l1 * l1 - l2 * l2) / (2.0 * l1 * l2)
    elbow = np.arccos(np.clip(cosine, -1.0, 1.0)) * np.sign(np.sin(theta[:, 1]))
    first = np.arctan2(z[:, 1], z[:, 0])
    first = first - np.arctan2(l2 * np.sin(elbow), l1 + l2 * np.cos(elbow))
    y = np.column_stack([first, elbow])
    turns = 2.0 * np.pi * np.round((theta - y) / (2.0 * np.pi))
    return np.asarray(y + turns)


def rigid_rates(y: np.ndarray, tip_speed: np.ndarray, l1: float, l2: float) -> np.ndarray:
    """y' (N, 2) = J(y)^-1 z' in rad/s from the rigid arm's angles y (N, 2) and z' = `tip_speed`
    (N, 2) in m/s, l1 and l2 in m; NaN where the arm is stretched or folded exactly, as an arm that
    starts at zero is."""
    J = rigid_jacobian(y, l1, l2)
    singular = np.linalg.det(J) == 0.0
    J[singular] = np.eye(2)
    rates = np.linalg.solve(J, tip_speed[:, :, None])[:, :, 0]
    rates[singular] = np.nan
    return np.asarray(rates)
