"""Segments that stiffen when they bend far."""

import numpy as np
import sympy as sp

from ..arm.arm import Arm
from ..arm.chord import deflection_rows
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter, Rig, Values
from ..effects.per_joint import sized
from ..effects.per_segment import bending, unbent
from ..effects.sizes import Sizes
from ..forces.element import Element
from ..forces.law import X, joint_law

_K3 = sp.Symbol("k_3", nonnegative=True)
LAW = joint_law(-_K3 * X**3, (_K3,))

START_STIFFENING = 0.2
"""Of the beam's own tip stiffness, at the typical deflection: a size to begin with."""


class CubicStiffness(Effect):
    """Hardening only. A softening cubic spring has no lowest energy: beyond sqrt(k / k3) it pushes
    the beam away for ever, so a fit that tries it meets motions that explode; and a free sign
    would let it imitate whatever bends the other way.
    """

    kind = "cubic_stiffness"
    location = "segments"
    title = "Cubic bending stiffness"
    story = (
        "A strongly bent beam resists more than in proportion: its ends pull on it, or it touches "
        "a cover. Small vibrations keep their frequency; large ones become faster. The residual "
        "appears only where the deflection is large, and looks like its cube."
    )
    formula = r"F = -k_3 \, \delta(l)^3"
    acts_at = "segments"

    def not_applicable(self, rig: Rig) -> str:
        return unbent(rig)

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        def make(k: int) -> EffectParameter:
            s = arm.segments[k]
            stiffness = 3.0 * s.bending_stiffness / s.length**3
            start = START_STIFFENING * stiffness / float(sizes.deflection[k]) ** 2
            title = f"cubic stiffness of segment {k + 1}"
            return sized(f"k3{k + 1}", start, "N/m³", title, symbol=rf"k_{{3,{k + 1}}}")

        return tuple(make(k) for k in bending(arm))

    def elements(self, arm: Arm, p: np.ndarray, values: Values) -> tuple[Element, ...]:
        rows = deflection_rows(arm, p)
        return tuple(Element(LAW, (rows[k],), (values[f"k3{k + 1}"],)) for k in bending(arm))
