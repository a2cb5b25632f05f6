"""Accelerometers on links."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..arm.arm import Arm
from ..arm.point_motion import Motion, normal_acceleration
from ..drives.law import DriveLaw
from ..drives.servo import slopes
from ..recording.recording import Recording
from ..sensors.link_sensor import LinkSensor, families
from ..sensors.sensor import OutputRows, rows_of
from ..trajectory import Trajectory

if TYPE_CHECKING:
    from ..arm.compiled import CompiledArm
    from ..simulate.posture import Posture

SLOPE_STEP = 1e-5
"""rad or m: of central differences of gravity's part, exact to 1e-10 of it."""


class Acceleration(LinkSensor):
    """Acceleration at a place of a link along its normal, minus gravity, as an accelerometer reads
    it: a level link at rest under gravity reads 9.81 m/s².

    The coordinates' accelerations are slopes of splines through their rates at the samples.
    """

    kind = "acceleration"
    title = "accelerometers"
    noise = "acceleration_noise"
    letter, called = "a", "accelerometer"
    slow = True
    unit = "m/s²"
    columns = families("acceleration", "m/s²", "acceleration of a link (accelerometer)")

    def measure(self, trajectory: Trajectory) -> np.ndarray:
        time = trajectory.time
        dt = float(time[-1] - time[0]) / (len(time) - 1)
        return self._read(trajectory.arm, trajectory.p, trajectory.q, trajectory.v, dt)

    def _read(self, arm: Arm, p: np.ndarray, q: np.ndarray, v: np.ndarray, dt: float) -> np.ndarray:
        motion = Motion(q, v, slopes(v, dt))
        return np.column_stack(
            [normal_acceleration(arm, p, motion, k, x) for k, x, _ in self.places(arm, p)]
        )

    def linearised(self, at: Posture) -> tuple[np.ndarray, np.ndarray]:
        """At rest the reading moves with the coordinates, which turn it in the field of gravity,
        and with their accelerations."""
        arm, n = at.model.arm, at.model.arm.coordinates
        resting, unit = np.tile(at.q, (n, 1)), np.eye(n)

        def read(q: np.ndarray, a: np.ndarray) -> np.ndarray:
            motion = Motion(q, np.zeros((n, n)), a)
            each = [normal_acceleration(arm, at.numbers.p, motion, k, x) for k, x, _ in places]
            return np.array(each).reshape(len(places), n)

        places = self.places(arm, at.numbers.p)
        by_place = (
            read(resting + SLOPE_STEP * unit, 0.0 * unit)
            - read(resting - SLOPE_STEP * unit, 0.0 * unit)
        ) / (2.0 * SLOPE_STEP)
        by_acceleration = read(resting, unit) - read(resting, 0.0 * unit)
        change = np.linalg.solve(at.E, np.hstack([at.A, at.B]))[n : 2 * n]
        C, D = np.split(by_acceleration @ change, [at.states], axis=1)
        C[:, :n] += by_place
        return C, D

    def linear_rows(
        self, recording: Recording, arm: Arm, p: np.ndarray, law: DriveLaw
    ) -> OutputRows:
        n = arm.coordinates
        rows = rows_of(arm, law, 2 * n)
        rows.Q[:n], rows.V[n:] = np.eye(n), np.eye(n)
        return rows

    def from_linear(
        self, y: np.ndarray, recording: Recording, arm: Arm, compiled: CompiledArm, p: np.ndarray
    ) -> np.ndarray:
        n, dt = arm.coordinates, recording.sample_time
        each = [self._read(arm, p[s], y[:, :n, s], y[:, n:, s], dt) for s in range(len(p))]
        return np.stack(each, axis=2)

    def is_linear(self, recording: Recording, arm: Arm) -> bool:
        return False
