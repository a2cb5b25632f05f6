"""A motor that cannot give more torque than it can."""

from dataclasses import replace

import numpy as np

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..drives.law import DriveLaw
from ..effects.effect import Effect, EffectParameter, Rig, Values, torque_is_replayed
from ..effects.per_joint import each_joint
from ..effects.sizes import Sizes

LIMITS = (0.95, 0.8, 0.6, 0.4, 0.25)
"""Of the largest torque that the unlimited model asks for."""

NEVER = 1e9
"""N m (N): a limit that nothing reaches."""


class DriveSaturation(Effect):
    """Cuts the torque of each drive, on top of the limits that are stated."""

    kind = "drive_saturation"
    location = "drive"
    title = "Limited torque"
    story = (
        "Every amplifier has a largest current and every motor a largest torque. Where the loop "
        "demands more, the joint lags behind briefly and catches up later. The error comes in "
        "bursts, right after large steps of the reference. Small motions show nothing."
    )
    formula = r"u = \max(-u_l, \min(u_l, u^*))"
    acts_at = "drive"

    def not_applicable(self, rig: Rig) -> str:
        if torque_is_replayed(rig):
            return (
                "The torque of this rig is recorded as applied, so it already contains any limit."
            )
        return ""

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        peak = sizes.peak_torque
        return each_joint(
            arm, "ul", "largest torque of drive {}", lambda j: j.effort_unit, LIMITS[2] * peak,
            lower=0.01 * peak, upper=10.0 * peak, neutral=NEVER, grid=np.outer(peak, LIMITS),
        )  # fmt: skip

    def law(self, law: DriveLaw, arm: Arm, p: np.ndarray, values: Values) -> DriveLaw:
        stated = np.array([values[f"ul{k + 1}"] for k in range(arm.joints)])
        return replace(law, limit=np.minimum(law.limit, stated))
