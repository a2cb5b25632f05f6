"""Recorded joint torques, or motor currents times torque constants."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from core.arm.arm import Arm
from core.arm.joints import joint
from core.drives.drive import Drive, per_joint
from core.drives.law import DriveLaw, static_law
from core.parameters import Parameter
from core.quantities import Positive


class Torque(Drive):
    """u as recorded in u1, u2, ..., or `torque_constants` (N m/A) times i1, i2, ..."""

    kind: ClassVar[str] = "torque"

    torque_constants: tuple[Positive, ...] | None = None

    def check(self, arm: Arm) -> None:
        if self.torque_constants is not None:
            per_joint(self.torque_constants, arm, "torque_constants")

    def parameters(self, arm: Arm) -> tuple[Parameter, ...]:
        return tuple(
            Parameter(
                f"kt{k + 1}", constant, f"{joint(arm.segments[k].joint).effort_unit}/A",
                constant / 10.0, constant * 10.0, rf"k_{{t{k + 1}}}",
                f"torque constant of motor {k + 1}", scale=constant,
            )
            for k, constant in enumerate(self.torque_constants or ())
        )  # fmt: skip

    def reference_channels(self, arm: Arm) -> tuple[str, ...]:
        letter = "u" if self.torque_constants is None else "i"
        return tuple(f"{letter}{k + 1}" for k in range(arm.joints))

    def latex(self) -> str:
        if self.torque_constants:
            return r"u_k = i_k \, k_{t,k}"
        return r"u = u_{\mathrm{recorded}}"

    def law(self, arm: Arm, p: np.ndarray, values: Mapping[str, float]) -> DriveLaw:
        stated = self.torque_constants or (1.0,) * arm.joints
        constants = [values.get(f"kt{k + 1}", constant) for k, constant in enumerate(stated)]
        nothing = np.zeros((arm.joints, arm.coordinates))
        return static_law(np.diag(constants).astype(float), nothing, nothing.copy())
