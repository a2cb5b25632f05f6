"""Recorded joint torques, or motor currents times torque constants."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ..arm.arm import Arm
from ..drives.drive import Drive, per_joint, stated_or, torque_constants
from ..drives.law import DriveLaw, static_law
from ..parameters import Parameter
from ..validation import Positive


class Torque(Drive):
    """u as recorded in u1, u2, ..., or `torque_constants` (N m/A) times i1, i2, ..."""

    kind: ClassVar[str] = "torque"

    torque_constants: tuple[Positive, ...] | None = None
    """N m/A (N/A on a slide), one per joint, of recorded currents; None: torques are recorded."""

    def check(self, arm: Arm) -> None:
        if self.torque_constants is not None:
            per_joint(self.torque_constants, arm, "torque_constants")

    def parameters(self, arm: Arm) -> tuple[Parameter, ...]:
        if self.torque_constants is not None:
            return torque_constants(self.torque_constants, arm)
        return tuple(
            Parameter(
                f"kt{k + 1}", 1.0, "", 0.1, 10.0, rf"k_{{t{k + 1}}}",
                f"scale of the recorded torque of motor {k + 1}",
            )
            for k in range(arm.joints)
        )  # fmt: skip

    def reference_channels(self, arm: Arm) -> tuple[str, ...]:
        letter = "u" if self.torque_constants is None else "i"
        return tuple(f"{letter}{k + 1}" for k in range(arm.joints))

    def scales(self, arm: Arm) -> dict[str, str]:
        names = self.reference_channels(arm)
        return {name: f"kt{k + 1}" for k, name in enumerate(names)}

    def latex(self) -> str:
        if self.torque_constants:
            return r"u_k = i_k \, k_{t,k}"
        return r"u = u_{\mathrm{recorded}}"

    def law(self, arm: Arm, p: np.ndarray, values: Mapping[str, float]) -> DriveLaw:
        stated = self.torque_constants or (1.0,) * arm.joints
        constants = stated_or("kt", stated, values)
        zeros = np.zeros((arm.joints, arm.coordinates))
        return static_law(np.diag(constants), zeros, zeros.copy())
