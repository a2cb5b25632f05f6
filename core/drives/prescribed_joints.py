"""Joints that the rig's own servo moves: they follow the encoders, and no torque is known."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..drives.law import DriveLaw, static_law


class PrescribedJoints(Drive):
    """The joints follow the recorded theta1, theta2, ...; the bending is simulated.

    For rigs with an unknown servo and no recorded torque or current. Effects at a joint, such as
    its friction, then change no measured channel. Gauges, the camera and link-side encoders are
    compared. A simulation needs a recording.
    """

    kind: ClassVar[str] = "held"
    torque_known: ClassVar[bool] = False

    def reference_channels(self, arm: Arm) -> tuple[str, ...]:
        return ()

    def needed_channels(self, arm: Arm) -> tuple[str, ...]:
        return tuple(f"theta{k + 1}" for k in range(arm.joints))

    def latex(self) -> str:
        return r"\theta(t) = \theta_{\mathrm{recorded}}(t)"

    def law(self, arm: Arm, p: np.ndarray, values: Mapping[str, float]) -> DriveLaw:
        zeros = np.zeros((arm.joints, arm.coordinates))
        return static_law(np.zeros((arm.joints, 0)), zeros, zeros.copy())
