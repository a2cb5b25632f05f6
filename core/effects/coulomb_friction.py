"""Dry friction: a constant level against the motion."""

import numpy as np
import sympy as sp

from core.arm.arm import Arm
from core.arm.joints import joint
from core.drives.drive import Drive
from core.effects.edge import edge
from core.effects.effect import Effect, Knob, Values
from core.effects.per_joint import each_joint, joint_elements, sized
from core.effects.sizes import Sizes
from core.forces.element import Element
from core.forces.law import V, joint_law

_FC, _VE = sp.Symbol("f_c", nonnegative=True), sp.Symbol("v_e", positive=True)
LAW = joint_law(-_FC * sp.tanh(V / _VE), (_FC, _VE))

SHARE = 0.1
"""Of the typical torque: a size to begin with."""


class CoulombFriction(Effect):
    """-f_c sign(theta') at every joint, the sign smoothed over `edge`."""

    kind = "coulomb_friction"
    room = "joint"
    title = "Coulomb friction"
    story = (
        "Two dry surfaces rub: the friction has the same level at every speed and turns round "
        "with the direction of motion. The missing joint torque, drawn over the joint's velocity, "
        "is a step at zero."
    )
    formula = r"\tau = -f_c \, \mathrm{sign}(\dot\theta)"
    dissipative = True
    longest_step = 1.25e-4
    acts_at = "joints"

    def knobs(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[Knob, ...]:
        def make(k: int) -> Knob:
            unit = joint(arm.segments[k].joint).effort_unit
            title = f"Coulomb friction of joint {k + 1}"
            return sized(
                f"fc{k + 1}", SHARE * float(sizes.torque[k]), unit, title, rf"f_{{c{k + 1}}}"
            )

        return each_joint(arm, make)

    def elements(self, arm: Arm, p: np.ndarray, values: Values) -> tuple[Element, ...]:
        return joint_elements(arm, LAW, ("fc",), values, edge)
