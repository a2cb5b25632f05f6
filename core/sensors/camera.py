"""The tip camera: the place of the end effector."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..arm.arm import Arm
from ..drives.law import DriveLaw
from ..recording.recording import Recording
from ..sensors.sensor import Channel, OutputRows, Sensor, rows_of

if TYPE_CHECKING:
    from ..arm.compiled import CompiledArm
    from ..simulate.posture import Posture
    from ..trajectory import Trajectory


class Camera(Sensor):
    """Place z of the end effector in the plane, (3) of the paper."""

    kind = "z"
    drifts = True
    title = "tip camera"
    noise = "camera_noise"
    primary = True
    from_camera = True
    slow = True
    at_camera_rate = True

    def channels(self, arm: Arm) -> tuple[Channel, ...]:
        return Channel("z1", "m"), Channel("z2", "m")

    def measure(self, trajectory: Trajectory) -> np.ndarray:
        return trajectory.tip()[0]

    def linearised(self, at: Posture) -> tuple[np.ndarray, np.ndarray]:
        C = np.zeros((2, at.states))
        C[:, : at.model.arm.coordinates] = at.model.compiled.tip_place(at.q, at.numbers.p)[1]
        return C, np.zeros((2, at.numbers.law.references))

    def linear_rows(
        self, recording: Recording, arm: Arm, p: np.ndarray, law: DriveLaw
    ) -> OutputRows:
        rows = rows_of(arm, law, arm.coordinates)
        rows.Q[:, :] = np.eye(arm.coordinates)
        return rows

    def from_linear(
        self, y: np.ndarray, recording: Recording, arm: Arm, compiled: CompiledArm, p: np.ndarray
    ) -> np.ndarray:
        return compiled.tip_places(y, p)

    def is_linear(self, recording: Recording, arm: Arm) -> bool:
        return False
