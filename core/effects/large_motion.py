"""Motions too large for a linear model."""

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter, Rig
from ..effects.sizes import Sizes


class LargeMotion(Effect):
    """The full equations (1) of the paper in place of their linearisation (6); switched."""

    kind = "large_motion"
    location = "motion"
    title = "Large motion"
    story = (
        "The linear model is valid near one posture and for slow rotation. In a large or fast "
        "motion the inertia changes on the way. The arm's own rotation pulls it outwards, and a "
        "bent beam becomes shorter. The residual is small near the working point. It grows with "
        "the excursion and with the square of the speed."
    )
    formula = r"M(q)\,\ddot q = F(q, \dot q) + G u"
    acts_at = "joints"

    def not_applicable(self, rig: Rig) -> str:
        return "" if rig.level == "lpv" else "The model is non-linear already."

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        return ()
