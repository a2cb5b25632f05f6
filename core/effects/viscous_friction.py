"""Friction proportional to speed."""

import numpy as np
import sympy as sp

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter, Values
from ..effects.per_joint import each_joint, joint_elements
from ..effects.sizes import FRICTION_SHARE, Sizes
from ..forces.element import Element
from ..forces.law import V, joint_law

_FV = sp.Symbol("f_v", nonnegative=True)
LAW = joint_law(-_FV * V, (_FV,))


class ViscousFriction(Effect):
    """-f_v theta' at every joint."""

    kind = "viscous_friction"
    location = "joint"
    title = "Viscous joint friction"
    story = (
        "Grease and motor windings brake a joint in proportion to its speed. The missing joint "
        "torque, plotted over the joint's velocity, is a straight line through zero."
    )
    formula = r"\tau = -f_v \, \dot\theta"
    linear = True
    dissipative = True
    acts_at = "joints"

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        start = FRICTION_SHARE * (sizes.torque / sizes.speed)
        title = "viscous friction of joint {}"
        return each_joint(arm, "fv", title, lambda j: j.damping_unit, start)

    def elements(self, arm: Arm, p: np.ndarray, values: Values) -> tuple[Element, ...]:
        return joint_elements(arm, LAW, ("fv",), values)
