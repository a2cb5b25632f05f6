"""A torque that repeats with the joint's position."""

import numpy as np
import sympy as sp

from ..arm.arm import Arm
from ..arm.joints import joint
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter, Values
from ..effects.per_joint import each_joint, joint_elements, sized
from ..effects.sizes import DISTURBANCE_SHARE, Sizes
from ..forces.element import Element
from ..forces.law import X, joint_law

_RA, _RB = sp.Symbol("r_a", real=True), sp.Symbol("r_b", real=True)
_NR = sp.Symbol("n_r", positive=True)
LAW = joint_law(_RA * sp.cos(_NR * X) + _RB * sp.sin(_NR * X), (_RA, _RB, _NR))

_PITCHES = (0.06, 0.03, 0.02, 0.01)
"""m: distances of the magnets of linear motors, leads of screws."""

ORDERS = {
    "rad": (6.0, 12.0, 24.0, 36.0, 60.0, 100.0),
    "m": tuple(2.0 * np.pi / pitch for pitch in _PITCHES),
}
"""By the joint's unit, periods per turn (radians per metre): poles, slots and gear teeth."""


FEWEST_ORDERS = 3
"""Orders to try; where the travel shows fewer of the usual ones, multiples of its lowest."""

MULTIPLES = (1.0, 1.5, 2.5, 4.0)


def visible_orders(usual: tuple[float, ...], travel: float) -> tuple[float, ...]:
    """Orders of which a travel (rad or m) shows one whole wave: less of it is an offset."""
    least = 2.0 * np.pi / travel
    visible = tuple(order for order in usual if order >= least)
    return visible if len(visible) >= FEWEST_ORDERS else tuple(least * m for m in MULTIPLES)


MOST_ORDERS = 4000
"""Orders of a second look."""


def every_order(grid: tuple[float, ...], span: float) -> tuple[float, ...]:
    """From the lowest to the highest of a `grid`, a quarter of a wave over the `span` (rad or m) of
    all positions apart: waves that differ by a whole one look nothing alike, so a descent finds no
    way between them."""
    count = int(np.clip((grid[-1] - grid[0]) * span / (0.5 * np.pi), len(grid), MOST_ORDERS))
    return tuple(np.linspace(grid[0], grid[-1], count + 1).tolist())


class TorqueRipple(Effect):
    """One wave per joint, as cosine and sine: their sizes enter linearly, the order does not."""

    kind = "torque_ripple"
    location = "joint"
    title = "Torque ripple"
    story = (
        "The magnets of a motor and the teeth of a gear make the torque vary with the joint's "
        "position. It repeats at the same positions. The missing joint torque, plotted over the "
        "joint's position, is a wave. A short motion shows only part of the wave. That part looks "
        "like an offset or a soft spring."
    )
    formula = r"\tau = r_a \cos(n_r \theta) + r_b \sin(n_r \theta)"
    acts_at = "joints"

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        def part(letter: str, wave: str) -> tuple[EffectParameter, ...]:
            start = DISTURBANCE_SHARE * sizes.torque
            title = f"{wave} part of the torque ripple of joint {{}}"
            return each_joint(arm, f"r{letter}", title, lambda j: j.effort_unit, start, signed=True)

        def order(k: int) -> EffectParameter:
            unit = joint(arm.segments[k].joint).coordinate_unit
            grid = visible_orders(ORDERS[unit], float(sizes.travel[k]))
            title = f"order of the torque ripple of joint {k + 1}"
            return sized(
                f"nr{k + 1}", grid[1], f"1/{unit}", title, lower=0.8 * grid[0],
                upper=2.0 * grid[-1], neutral=grid[1], grid=grid, secondary=True,
                fine_grid=every_order(grid, float(sizes.span[k])),
            )  # fmt: skip

        orders = tuple(order(k) for k in range(arm.joints))
        return part("a", "cosine") + part("b", "sine") + orders

    def elements(self, arm: Arm, p: np.ndarray, values: Values) -> tuple[Element, ...]:
        return joint_elements(arm, LAW, ("ra", "rb", "nr"), values)
