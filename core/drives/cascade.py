"""A position loop around a velocity loop."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from core.arm.arm import Arm
from core.drives.drive import Drive, per_joint
from core.drives.law import DriveLaw, static_law
from core.quantities import NonNegative, Positive


class Cascade(Drive):
    """u = kv (kp (theta* - theta) - theta'), kp in 1/s, kv in N m s/rad (N s/m on a slide)."""

    kind: ClassVar[str] = "cascade"

    position_gains: tuple[NonNegative, ...]
    velocity_gains: tuple[NonNegative, ...]
    limits: tuple[Positive, ...] | None = None

    def check(self, arm: Arm) -> None:
        per_joint(self.position_gains, arm, "position_gains")
        per_joint(self.velocity_gains, arm, "velocity_gains")
        if self.limits is not None:
            per_joint(self.limits, arm, "limits")

    def reference_channels(self, arm: Arm) -> tuple[str, ...]:
        return tuple(f"theta{k + 1}_ref" for k in range(arm.joints))

    def latex(self) -> str:
        return r"u = k_v (k_p (\theta^* - \theta) - \dot{\theta})"

    def law(self, arm: Arm, p: np.ndarray, values: Mapping[str, float]) -> DriveLaw:
        speed = np.array(self.velocity_gains, dtype=float)
        place = speed * np.array(self.position_gains, dtype=float)
        P = np.zeros((arm.joints, arm.coordinates))
        V = np.zeros_like(P)
        P[:, : arm.joints] = np.diag(place)
        V[:, : arm.joints] = np.diag(speed)
        limit = None if self.limits is None else np.array(self.limits, dtype=float)
        return static_law(np.diag(place), P, V, limit)
