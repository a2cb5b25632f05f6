"""Velocity loops: u = Lambda (theta'* - theta'), (10) of the paper."""

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


class VelocityLoop(Drive):
    """One proportional velocity loop per joint, gains in N m s/rad (N s/m on a slide)."""

    kind: ClassVar[str] = "velocity_loop"
    sliders: ClassVar[tuple[DriveSlider, ...]] = (
        DriveSlider("gains", "λ", "N m s/rad", (0.0, 300.0, 1.0), "Gain of the velocity loop."),
    )

    gains: tuple[NonNegative, ...]
    """N m s/rad (N s/m on a slide), one per joint."""
    limits: tuple[Positive, ...] | None = None
    """N m (N on a slide), one per joint; None: no limit."""

    def check(self, arm: Arm) -> None:
        per_joint(self.gains, arm, "gains")
        if self.limits is not None:
            per_joint(self.limits, arm, "limits")

    def parameters(self, arm: Arm) -> tuple[Parameter, ...]:
        def make(k: int, gain: float) -> Parameter:
            unit = joint(arm.segments[k].joint).damping_unit
            title = f"gain of velocity loop {k + 1}"
            return gain_parameter(f"lambda{k + 1}", gain, unit, rf"\lambda_{{{k + 1}}}", title)

        return tuple(make(k, gain) for k, gain in enumerate(self.gains))

    def reference_channels(self, arm: Arm) -> tuple[str, ...]:
        return tuple(f"dtheta{k + 1}_ref" for k in range(arm.joints))

    def latex(self) -> str:
        gains = r"\Lambda = \mathrm{diag}(\lambda_k)"
        return rf"u = \Lambda (\dot{{\theta}}^* - \dot{{\theta}}), \qquad {gains}"

    def law(self, arm: Arm, p: np.ndarray, values: Mapping[str, float]) -> DriveLaw:
        R = np.diag(stated_or("lambda", self.gains, values))
        feedback = np.zeros((arm.joints, arm.coordinates))
        feedback[:, : arm.joints] = R
        limit = None if self.limits is None else np.array(self.limits, dtype=float)
        return static_law(R, np.zeros_like(feedback), feedback, limit)
