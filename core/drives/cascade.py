"""A position loop around a velocity loop."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ..arm.arm import Arm
from ..arm.joints import joint
from ..drives.drive import Drive, DriveSlider, gain_parameter, per_joint, stated_or
from ..drives.law import DriveLaw, static_law
from ..parameters import Parameter
from ..validation import NonNegative, Positive


class Cascade(Drive):
    """u = kv (kp (theta* - theta) - theta'), kp in 1/s, kv in N m s/rad (N s/m on a slide)."""

    kind: ClassVar[str] = "cascade"
    sliders: ClassVar[tuple[DriveSlider, ...]] = (
        DriveSlider("position_gains", "kp", "1/s", (0.0, 100.0, 0.5), "Gain of the position loop."),
        DriveSlider(
            "velocity_gains", "kv", "N m s/rad", (0.0, 300.0, 1.0), "Gain of the velocity loop."
        ),
    )

    position_gains: tuple[NonNegative, ...]
    """1/s, one per joint."""
    velocity_gains: tuple[NonNegative, ...]
    """N m s/rad (N s/m on a slide), one per joint."""
    limits: tuple[Positive, ...] | None = None
    """N m (N on a slide), one per joint; None: no limit."""

    def check(self, arm: Arm) -> None:
        per_joint(self.position_gains, arm, "position_gains")
        per_joint(self.velocity_gains, arm, "velocity_gains")
        if self.limits is not None:
            per_joint(self.limits, arm, "limits")

    def parameters(self, arm: Arm) -> tuple[Parameter, ...]:
        def units(k: int) -> str:
            return joint(arm.segments[k].joint).damping_unit

        place = [
            gain_parameter(f"kp{k + 1}", gain, "1/s", rf"k_{{p{k + 1}}}", f"position gain {k + 1}")
            for k, gain in enumerate(self.position_gains)
        ]
        speed = [
            gain_parameter(
                f"kv{k + 1}", gain, units(k), rf"k_{{v{k + 1}}}", f"velocity gain {k + 1}"
            )
            for k, gain in enumerate(self.velocity_gains)
        ]
        return (*place, *speed)

    def reference_channels(self, arm: Arm) -> tuple[str, ...]:
        return tuple(f"theta{k + 1}_ref" for k in range(arm.joints))

    def latex(self) -> str:
        return r"u = k_v (k_p (\theta^* - \theta) - \dot{\theta})"

    def law(self, arm: Arm, p: np.ndarray, values: Mapping[str, float]) -> DriveLaw:
        speed = stated_or("kv", self.velocity_gains, values)
        place = speed * stated_or("kp", self.position_gains, values)
        P = np.zeros((arm.joints, arm.coordinates))
        V = np.zeros_like(P)
        P[:, : arm.joints] = np.diag(place)
        V[:, : arm.joints] = np.diag(speed)
        limit = None if self.limits is None else np.array(self.limits, dtype=float)
        return static_law(np.diag(place), P, V, limit)
