"""A mass at the tip."""

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter
from ..effects.per_segment import arm_parameter
from ..effects.sizes import Sizes

START_SHARE_OF_MASS = 0.1
"""Of the segment's mass: a payload to begin with."""

LARGEST_SHARE_OF_MASS = 10.0
"""Times the segment's mass: no light arm carries more."""


def free_ends(arm: Arm) -> tuple[int, ...]:
    """Segments (from 0) whose end carries no other segment."""
    last = arm.joints - 1
    return tuple(k for k in range(arm.joints) if k == last or arm.segments[k + 1].mount == "ground")


class TipPayload(Effect):
    """A point mass at each free end, in kg."""

    kind = "tip_payload"
    location = "segments"
    title = "Tip payload"
    story = (
        "The arm carries something that is not in the model: a gripper, a cable's plug, the "
        "camera's target. The arm accelerates more slowly, and its vibration frequencies are "
        "lower. The residual looks like the acceleration of the tip. The missing joint torque is "
        "a line over the joint's acceleration."
    )
    formula = r"T \leftarrow T + \tfrac{1}{2} m_t \, \| \dot z \|^2"
    linear = True
    acts_at = "tip"

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        def make(k: int) -> EffectParameter:
            s = arm.segments[k]
            most = s.tip_mass + LARGEST_SHARE_OF_MASS * s.mass
            return arm_parameter(arm, f"mt{k + 1}", START_SHARE_OF_MASS * s.mass, 0.0, most)

        return tuple(make(k) for k in free_ends(arm))
