"""Friction that grows with the torque that a joint transmits."""

import numpy as np
import sympy as sp

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..effects.bristle import IDEALISED, breakaway, bristle_force
from ..effects.effect import Effect, EffectParameter, Values
from ..effects.per_joint import each_joint, joint_direction
from ..effects.sizes import Sizes
from ..forces.element import Element
from ..forces.law import W

_LD, _LB = sp.Symbol("l_d", nonnegative=True), sp.Symbol("l_b", nonnegative=True)
_U = sp.Symbol("u", real=True)
LAW = bristle_force(
    -(_LD + _LB) / 2 * sp.Abs(_U) * W - (_LD - _LB) / 2 * _U * sp.Abs(W), (_LD, _LB), load=_U
)
"""l_d |u| against the motion where u and W have the same sign, else l_b |u|."""

START_LOSS = 0.1
"""Of the torque: a good gear loses less, a worm gear much more."""

MOST_LOSS = 0.95
"""Of the torque: with all of it lost while driving, nothing would ever move."""


class LoadFriction(Effect):
    """A share of the drive's torque, one while it drives the joint, one while it brakes it.

    The torque that a joint transmits is taken to be the drive's. Extended friction models of servo
    actuators (BAM, "better actuator models") have both, the load and the direction.
    """

    kind = "load_friction"
    location = "joint"
    title = "Friction that grows with the load"
    story = (
        "Teeth that press harder on each other also rub harder. A gear therefore loses a share of "
        "the torque that it transmits. While the motor drives the joint, the arm gets less torque "
        "than the motor gives. While the motor brakes, the gear helps it, often with another "
        "share. The missing joint torque changes its sign with the direction of motion, as with "
        "Coulomb friction. But it is large where the drive torque is large, and vanishes where "
        "the drive idles. Look at acceleration, at braking, and at an arm held up against "
        "gravity."
    )
    formula = (
        r"\tau = -l \, |u| \, \mathrm{sign}(\dot\theta), \qquad "
        r"l = l_d \text{ where } u \dot\theta > 0, \text{ else } l_b"
    )
    dissipative = True
    idealised = IDEALISED
    acts_at = "joints"
    ruled_out_by = "direct_drive"

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        def share(letter: str, while_: str) -> tuple[EffectParameter, ...]:
            title = f"share of the torque that joint {{}} loses while it {while_}"
            return each_joint(arm, f"l{letter}", title, lambda _: "", START_LOSS, upper=MOST_LOSS)

        return share("d", "is driven") + share("b", "is braked")

    def elements(self, arm: Arm, p: np.ndarray, values: Values) -> tuple[Element, ...]:
        return tuple(
            Element(
                LAW,
                (joint_direction(arm, k),),
                (values[f"ld{k + 1}"], values[f"lb{k + 1}"], breakaway(arm, k, values), 0.0),
                loads=(k,),
            )
            for k in range(arm.joints)
        )
