"""Dry friction that gives way like a spring before it slips: Dahl's model."""

import numpy as np
import sympy as sp

from core.arm.arm import Arm
from core.arm.joints import joint
from core.drives.drive import Drive
from core.effects.edge import edge
from core.effects.effect import Effect, Knob, Values
from core.effects.per_joint import each_joint, joint_direction
from core.effects.positive import positive
from core.effects.sizes import Sizes
from core.forces.element import Element
from core.forces.law import V, W, joint_law

_FC, _ZS = sp.Symbol("f_c", nonnegative=True), sp.Symbol("z_s", positive=True)
_VE = sp.Symbol("v_e", positive=True)
LAW = joint_law(
    _FC * sp.tanh(V / _VE) - _FC * W / _ZS,
    (_FC, _ZS, _VE),
    rate=V - sp.Abs(V) * W / _ZS,
)
"""Coulomb's force is taken back and that of the bristles, bent by w, put in its place."""

SHARES = (0.003, 0.01, 0.03, 0.1, 0.3)
"""Of the joint's travel: breakaway displacements to try."""

SMALLEST, LARGEST = 1e-4, 1.0
"""Of the joint's travel: below, it slips at once; above, it is a spring that never slips."""


class PreslidingFriction(Effect):
    """Dahl's model; the level is Coulomb's, only the way to it is new."""

    kind = "presliding_friction"
    room = "joint"
    title = "Presliding friction"
    story = (
        "Rough surfaces hold on to each other like two brushes: before a joint slips, the bristles "
        "bend, and the friction grows with the displacement like a spring's force. After a "
        "turn-round it takes a small way until the full Coulomb level is back. The missing joint "
        "torque runs through a loop when drawn over the joint's position, and a joint at rest is "
        "pushed back a little. Described by P. Dahl in 1968."
    )
    formula = (
        r"\tau = -f_c \frac{w}{z_s}, \qquad "
        r"\dot w = \dot\theta - |\dot\theta| \frac{w}{z_s}"
    )
    includes = ("coulomb_friction",)
    dissipative = True
    longest_step = 1.25e-4
    acts_at = "joints"

    def knobs(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[Knob, ...]:
        def make(k: int) -> Knob:
            travel = float(sizes.travel[k])
            return positive(
                f"zs{k + 1}",
                SHARES[1] * travel,
                joint(arm.segments[k].joint).coordinate_unit,
                f"breakaway displacement of joint {k + 1}",
                rf"z_{{s{k + 1}}}",
                lower=SMALLEST * travel,
                upper=LARGEST * travel,
                grid=[share * travel for share in SHARES],
            )

        return each_joint(arm, make)

    def elements(self, arm: Arm, p: np.ndarray, values: Values) -> tuple[Element, ...]:
        sizes = [(values[f"fc{k + 1}"], values[f"zs{k + 1}"]) for k in range(arm.joints)]
        return tuple(
            Element(LAW, (joint_direction(arm, k),), (level, way, edge(arm.segments[k])))
            for k, (level, way) in enumerate(sizes)
            if way > 0.0
        )
