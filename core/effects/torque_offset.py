"""A constant torque that nobody commanded."""

import numpy as np
import sympy as sp

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter, Values
from ..effects.per_joint import each_joint, joint_elements
from ..effects.sizes import DISTURBANCE_SHARE, Sizes
from ..forces.element import Element
from ..forces.law import joint_law

_TO = sp.Symbol("t_o", real=True)
LAW = joint_law(_TO, (_TO,))


class TorqueOffset(Effect):
    """One constant torque per joint, of either sign."""

    kind = "torque_offset"
    location = "drive"
    title = "Torque offset"
    story = (
        "An amplifier with a small zero error, or a cable that pulls, adds the same torque all "
        "the time. A joint under velocity control then drifts. The missing joint torque is a "
        "horizontal line that does not pass through zero. Coulomb friction that differs between "
        "the two directions looks the same while the joint moves."
    )
    formula = r"\tau = t_o"
    acts_at = "drive"

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        start, title = DISTURBANCE_SHARE * sizes.torque, "torque offset of joint {}"
        return each_joint(arm, "to", title, lambda j: j.effort_unit, start, signed=True)

    def elements(self, arm: Arm, p: np.ndarray, values: Values) -> tuple[Element, ...]:
        return joint_elements(arm, LAW, ("to",), values)
