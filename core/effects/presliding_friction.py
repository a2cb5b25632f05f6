"""Dry friction that gives way like a spring before it slips: Dahl's model."""

import numpy as np

from ..arm.arm import Arm
from ..arm.joints import joint
from ..drives.drive import Drive
from ..effects.bristle import BREAKAWAY
from ..effects.effect import Effect, EffectParameter
from ..effects.per_joint import each_joint
from ..effects.sizes import Sizes

TRIED_BREAKAWAYS = (0.003, 0.01, 0.03, 0.1, 0.3)
"""Of the joint's travel: breakaway displacements to try."""

SMALLEST_BREAKAWAY, LARGEST_BREAKAWAY = 1e-4, 1.0 / np.log(20.0)
"""Of the joint's travel: below, it slips at once; above, a move through the whole travel leaves
more than 5 % of the Coulomb level unreached, so that it is a spring, of a cable or a hose, rather
than a friction that slips."""

SOFTEST = {"rad": 0.02, "m": 1e-3}
"""rad and m that are plausible however little a joint was moved: about a degree. Rolling bearings
break away within hundredths of a millimetre, geared joints within some milliradians (B.
Armstrong-Helouvry et al., Automatica 30, 1994), seals and belts later."""


class PreslidingFriction(Effect):
    """The way over which a joint's dry friction breaks away; its level is Coulomb's."""

    kind = "presliding_friction"
    location = "joint"
    title = "Presliding friction"
    story = (
        "Rough surfaces grip each other like two brushes. Before a joint slips, the bristles "
        "bend, and the friction grows with the displacement like a spring force. After a reversal "
        "the full Coulomb level is back only after a small displacement. The missing joint "
        "torque, plotted over the joint's position, is a loop. A joint at rest is pushed back a "
        "little. Described by P. Dahl in 1968."
    )
    formula = (
        r"\tau = -f_c u, \qquad "
        r"\dot u = \frac{\dot\theta - |\dot\theta| u}{z_s}"
    )
    includes = ("coulomb_friction",)
    dissipative = True
    acts_at = "joints"

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        softest = np.array([SOFTEST[joint(s.joint).coordinate_unit] for s in arm.segments])
        return each_joint(
            arm, BREAKAWAY, "breakaway displacement of joint {}", lambda j: j.coordinate_unit,
            TRIED_BREAKAWAYS[1] * sizes.travel, lower=SMALLEST_BREAKAWAY * sizes.travel,
            upper=np.maximum(LARGEST_BREAKAWAY * sizes.travel, softest),
            grid=np.outer(sizes.travel, TRIED_BREAKAWAYS),
        )  # fmt: skip
