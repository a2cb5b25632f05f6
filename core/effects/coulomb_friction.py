"""Dry friction: a constant level against the motion."""

import numpy as np
import sympy as sp

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..effects.bristle import IDEALISED, bristle_law, bristles
from ..effects.effect import Effect, EffectParameter, Values
from ..effects.per_joint import each_joint
from ..effects.sizes import FRICTION_SHARE, Sizes
from ..forces.element import Element

_FC = sp.Symbol("f_c", nonnegative=True)
LAW = bristle_law(_FC, (_FC,))


class CoulombFriction(Effect):
    """-f_c sign(theta') at every joint; at rest it holds against anything below f_c."""

    kind = "coulomb_friction"
    location = "joint"
    title = "Coulomb friction"
    story = (
        "Two dry surfaces rub. The friction has the same level at every speed and reverses with "
        "the direction of motion. It also holds a joint at rest. The share u of the level that "
        "acts follows the direction within 1e-6 rad (1e-6 m on a slide). The missing joint "
        "torque, plotted over the joint's velocity, is a step at zero."
    )
    formula = (
        r"\tau = -f_c u \approx -f_c \, \mathrm{sign}(\dot\theta), \qquad "
        r"\dot u = \frac{\dot\theta - |\dot\theta| u}{z_s}"
    )
    dissipative = True
    idealised = IDEALISED
    acts_at = "joints"

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        start, title = FRICTION_SHARE * sizes.torque, "Coulomb friction of joint {}"
        return each_joint(arm, "fc", title, lambda j: j.effort_unit, start)

    def elements(self, arm: Arm, p: np.ndarray, values: Values) -> tuple[Element, ...]:
        return bristles(arm, LAW, ("fc",), values)
