"""A position loop with a lead or lag compensator."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ..arm.arm import Arm
from ..arm.joints import joint
from ..drives.drive import Drive, DriveSlider, gain_parameter, per_joint, stated_or
from ..drives.law import DriveLaw
from ..parameters import Parameter
from ..validation import NonNegative, Positive


class Compensator(Drive):
    """u = k (s + z)/(s + p) (theta* - theta), k in N m/rad (N/m on a slide), z and p in rad/s.

    Voltages and counts of unknown size are in k: only k over the inertia shows in the motion.
    """

    kind: ClassVar[str] = "compensator"
    sliders: ClassVar[tuple[DriveSlider, ...]] = (
        DriveSlider("gains", "kc", "N m/rad", (0.0, 1000.0, 1.0), "Gain at high frequencies."),
    )

    gains: tuple[NonNegative, ...]
    """N m/rad (N/m on a slide), one per joint."""
    zeros: tuple[NonNegative, ...]
    """z in rad/s, one per joint."""
    poles: tuple[Positive, ...]
    """p in rad/s, one per joint."""
    limits: tuple[Positive, ...] | None = None
    """N m (N on a slide), one per joint; None: no limit."""

    def check(self, arm: Arm) -> None:
        for setting in ("gains", "zeros", "poles"):
            per_joint(getattr(self, setting), arm, setting)
        if self.limits is not None:
            per_joint(self.limits, arm, "limits")

    def parameters(self, arm: Arm) -> tuple[Parameter, ...]:
        units = [joint(s.joint) for s in arm.segments]
        return tuple(
            gain_parameter(
                f"kc{k + 1}", gain, f"{units[k].effort_unit}/{units[k].coordinate_unit}",
                rf"k_{{c{k + 1}}}", f"gain of the compensator of joint {k + 1}",
            )
            for k, gain in enumerate(self.gains)
        )  # fmt: skip

    def reference_channels(self, arm: Arm) -> tuple[str, ...]:
        return tuple(f"theta{k + 1}_ref" for k in range(arm.joints))

    def latex(self) -> str:
        return r"u = k_c \frac{s + z}{s + p} (\theta^* - \theta)"

    def law(self, arm: Arm, p: np.ndarray, values: Mapping[str, float]) -> DriveLaw:
        joints, n = arm.joints, arm.coordinates
        gains, unit = np.diag(stated_or("kc", self.gains, values)), np.eye(joints)
        poles, zeros = (np.array(x, dtype=float) for x in (self.poles, self.zeros))
        places = np.eye(joints, n)
        return DriveLaw(
            R=gains, P=gains @ places, V=np.zeros((joints, n)), S=gains @ np.diag(poles - zeros),
            Fs=-np.diag(poles), Fq=-places, Fv=np.zeros((joints, n)), Fr=unit,
            limit=np.full(joints, np.inf) if self.limits is None else np.array(self.limits),
        )  # fmt: skip
