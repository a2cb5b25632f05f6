"""Encoders whose zero is not where the model thinks."""

import numpy as np

from ..arm.arm import Arm
from ..arm.slots import arm_vector
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter, Rig, Values
from ..effects.per_joint import each_joint
from ..effects.sizes import Sizes

START_OFFSET, LARGEST_OFFSET = 0.01, 0.5
"""rad (m on a slide)"""


class EncoderOffset(Effect):
    """An offset per joint from the second on: true position = encoder - offset.

    Without gravity the offset of joint 1 equals the camera's rotation (`camera_misalignment`).
    """

    kind = "encoder_offset"
    location = "sensors"
    title = "Encoder offset"
    story = (
        "An encoder counts from where it was switched on. If its zero was set by eye, the elbow "
        "is bent a little more or less than the reading. The arm's inertia then belongs to "
        "another posture. The camera sees the tip beside the position that the encoders imply. "
        "The residual is constant and changes with the posture."
    )
    formula = r"\theta_{k,\mathrm{measured}} = \theta_k + o_k"
    linear = True
    acts_at = "joints"
    ruled_out_by = "encoders_calibrated"

    def not_applicable(self, rig: Rig) -> str:
        if rig.arm.joints < 2:
            return "An arm with one joint has no posture that an offset could change."
        if rig.servo or _acts_on_position(rig):
            return (
                "The joints are driven to the encoders' positions; the effect of an offset on that "
                "is not modelled."
            )
        return ""

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        return each_joint(
            arm, "eo", "encoder offset of joint {}", lambda j: j.coordinate_unit, START_OFFSET,
            signed=True, upper=LARGEST_OFFSET,
        )[1:]  # fmt: skip

    def started(self, joints: np.ndarray, values: Values) -> np.ndarray:
        return joints - _offsets(joints.shape[-1], values)

    def sensed(self, sensor: str, y: np.ndarray, dt: float, values: Values) -> np.ndarray:
        return y + _offsets(y.shape[-1], values) if sensor == "encoder" else y


def _offsets(count: int, values: Values) -> np.ndarray:
    """(nj,)"""
    return np.array([0.0, *[values[f"eo{k + 1}"] for k in range(1, count)]])


def _acts_on_position(rig: Rig) -> bool:
    """Whether the drive's controller reads the encoders' positions."""
    law = rig.drive.law(rig.arm, arm_vector(rig.arm), {})
    return bool(np.any(law.P) or np.any(law.Fq))
