"""Friction that differs between the two directions of motion."""

import numpy as np
import sympy as sp

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter, Values
from ..effects.per_joint import each_joint, joint_elements
from ..effects.sizes import Sizes
from ..forces.element import Element
from ..forces.law import V, joint_law

_FA = sp.Symbol("f_a", real=True)
LAW = joint_law(-_FA * sp.Abs(V), (_FA,))

ASYMMETRY_SHARE = 0.03
"""Of the typical torque at the typical speed: a third of where viscous friction begins."""


class FrictionAsymmetry(Effect):
    """The difference of the viscous part only; that of the Coulomb part is `torque_offset`."""

    kind = "friction_asymmetry"
    location = "joint"
    title = "Friction that depends on the direction"
    story = (
        "Screws, belts and gears often run more easily one way than the other. Viscous friction "
        "is the part that both directions share; this effect is half the difference. The missing "
        "joint torque, plotted over the joint's velocity, is a V. It has the same sign in both "
        "directions and grows with speed. A constant difference between the directions looks like "
        "a torque offset instead. Only slow and fast motion together distinguish the two."
    )
    formula = r"\tau = -f_a \, |\dot\theta|"
    acts_at = "joints"

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        start = ASYMMETRY_SHARE * (sizes.torque / sizes.speed)
        title = "half the difference of viscous friction of joint {}"
        return each_joint(arm, "fa", title, lambda j: j.damping_unit, start, signed=True)

    def elements(self, arm: Arm, p: np.ndarray, values: Values) -> tuple[Element, ...]:
        return joint_elements(arm, LAW, ("fa",), values)
