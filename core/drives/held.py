"""Joints that a servo of the rig holds: they follow the encoders, and no torque is known."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..drives.law import DriveLaw, static_law


class Held(Drive):
    """The joints move as theta1, theta2, ... say; what bends beyond them is simulated.

    For benches whose own servo is not known and whose torque or current is not recorded. What acts
    at a joint alone, such as its friction, then changes nothing that was measured. Compared are
    gauges, the camera and link-side encoders. Nothing can be simulated without a recording.
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
        nothing = np.zeros((arm.joints, arm.coordinates))
        return static_law(np.zeros((arm.joints, 0)), nothing, nothing.copy())
