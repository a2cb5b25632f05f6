"""The extra friction near standstill (R. Stribeck, 1902), in the form of a Gaussian of the speed
(B. Armstrong-Helouvry et al., Automatica 30, 1994)."""

import numpy as np
import sympy as sp

from ..arm.arm import Arm
from ..arm.joints import joint
from ..drives.drive import Drive
from ..effects.bristle import IDEALISED, bristle_law, bristles
from ..effects.effect import Effect, EffectParameter, Values
from ..effects.per_joint import each_joint
from ..effects.sizes import FRICTION_SHARE, Sizes
from ..forces.element import Element
from ..forces.law import V

_FB, _VS = sp.Symbol("f_b", nonnegative=True), sp.Symbol("v_s", positive=True)
LAW = bristle_law(_FB * sp.exp(-((V / _VS) ** 2)), (_FB, _VS))

PEAK_SHARE = 0.5 * FRICTION_SHARE
"""Of the typical torque: half of where Coulomb friction begins."""

LARGEST_PEAK = 40.0
"""Times the start, twice the typical torque: rubbing surfaces stick at most a few times harder
than they slide, and an unbounded peak at standstill explains anything that happens there."""

SPEEDS = (0.05, 0.1, 0.2, 0.4)
"""Of the typical speed. A wider bulge is Coulomb friction, a narrower one is never visited."""

NARROWEST = {"rad": 1.5e-3, "m": 3e-4}
"""rad/s and m/s: a joint that turns round passes through it within a step or two."""


class StribeckFriction(Effect):
    """Only the bulge near standstill; the level is Coulomb's."""

    kind = "stribeck_friction"
    location = "joint"
    title = "Stribeck friction"
    story = (
        "At very low speed the grease is squeezed out and metal touches metal. It takes more "
        "torque to start moving than to keep moving. The missing joint torque, plotted over the "
        "joint's velocity, has a peak on both sides of zero, on top of Coulomb friction. The peak "
        "is gone at a small speed. Look where the joint reverses."
    )
    formula = (
        r"\tau = -\left( f_c + f_b \, e^{-(\dot\theta / v_s)^2} \right) u, \qquad "
        r"\dot u = \frac{\dot\theta - |\dot\theta| u}{z_s}"
    )
    includes = ("coulomb_friction",)
    dissipative = True
    idealised = IDEALISED
    acts_at = "joints"

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        start, title = PEAK_SHARE * sizes.torque, "extra friction of joint {} at standstill"
        narrowest = np.array([NARROWEST[joint(s.joint).coordinate_unit] for s in arm.segments])
        grid = np.maximum(np.outer(sizes.speed, SPEEDS), narrowest[:, None])
        return (
            *each_joint(
                arm, "fb", title, lambda j: j.effort_unit, start, upper=LARGEST_PEAK * abs(start)
            ),
            *each_joint(
                arm, "vs", "Stribeck speed of joint {}", lambda j: f"{j.coordinate_unit}/s",
                grid[:, 1], lower=narrowest, upper=2.0 * grid[:, -1], neutral=grid[:, 1],
                grid=grid, secondary=True,
            ),
        )  # fmt: skip

    def elements(self, arm: Arm, p: np.ndarray, values: Values) -> tuple[Element, ...]:
        return bristles(arm, LAW, ("fb", "vs"), values)
