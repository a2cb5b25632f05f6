"""A plane of motion that is not level."""

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter
from ..effects.per_segment import arm_parameter
from ..effects.sizes import Sizes

START_TILT = 0.1
"""m/s^2: a tilt of about 0.6 degrees."""

LARGEST_TILT = 9.81
"""m/s^2 beside the stated gravity: a plane that is upright where it was thought level."""


class GravityTilt(Effect):
    """The two components of gravity in the plane of motion, m/s^2.

    Not part of the linear model: what tilts is above all a force that does not vanish at the
    working point, and x' = A x + B r has no place for one.
    """

    kind = "gravity_tilt"
    location = "motion"
    title = "Tilted base plate"
    story = (
        "The table is not level. A small part of gravity then acts in the plane of motion: 0.1 "
        "m/s² for about half a degree. The arm sags downhill and drifts that way, since a "
        "velocity loop only reacts to speed. The residual grows slowly and is the same in both "
        "directions of motion. It depends on the posture, not on the speed."
    )
    formula = r"V \leftarrow V - \int g^{\mathsf T} p \, \mathrm{d}m, \qquad g = (g_1, g_2)"
    acts_at = "base"
    ruled_out_by = "level"

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        return tuple(
            arm_parameter(arm, f"g{i + 1}", START_TILT, own - LARGEST_TILT, own + LARGEST_TILT)
            for i, own in enumerate(arm.gravity)
        )
