"""Resistance of the air at the tip."""

import numpy as np
import sympy as sp

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter, Values
from ..effects.per_joint import sized
from ..effects.sizes import FRICTION_SHARE, Sizes
from ..forces.element import Element
from ..forces.law import ForceLaw

EDGE = 1e-6
"""m/s: makes the law smooth at rest, where the root of zero has no slope."""

_C = sp.Symbol("c_d", nonnegative=True)
_X = sp.symbols("x1 x2", real=True)
_V = sp.symbols("v1 v2", real=True)
_SPEED = sp.sqrt(_V[0] ** 2 + _V[1] ** 2 + sp.Float(EDGE) ** 2)
LAW = ForceLaw(_X, _V, tuple(-_C * _SPEED * v for v in _V), (_C,))


class AirDrag(Effect):
    """-c_d |z'| z' at the tip, in N; |z'| smoothed over EDGE."""

    kind = "air_drag"
    location = "segments"
    title = "Air drag at the tip"
    story = (
        "A plate or a sail at the tip pushes the air aside. The force acts against the motion and "
        "grows with the square of the speed. Slow motion hardly shows it. In fast motion the "
        "residual follows the tip's velocity times its magnitude. A bare arm rarely shows it; a "
        "tip with a camera target may."
    )
    formula = r"F = -c_d \, \| \dot z \| \, \dot z"
    dissipative = True
    acts_at = "tip"

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        reach = sum(s.length for s in arm.segments)
        start = FRICTION_SHARE * float(sizes.torque.max()) / (reach * sizes.tip_speed**2)
        return (sized("cd", start, "N s²/m²", "drag of the tip"),)

    def elements(self, arm: Arm, p: np.ndarray, values: Values) -> tuple[Element, ...]:
        return (Element(LAW, (), (values["cd"],), at_tip=True),)
