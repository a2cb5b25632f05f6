"""Play in a gear."""

import numpy as np
import sympy as sp

from ..arm.arm import Arm
from ..arm.slots import TWIST_STIFFNESS, slot
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter, Values
from ..effects.joint_load import LEAST_LOAD, hub_parameters, joint_load, with_twisting_joints
from ..effects.per_joint import each_joint
from ..effects.sizes import Sizes
from ..forces.element import Element
from ..forces.law import V, X, joint_law

_B, _K = sp.Symbol("b_l", positive=True), sp.Symbol("k_j", positive=True)
_T, _E = sp.Symbol("t_c", positive=True), sp.Symbol("x_e", positive=True)
_TOUCH = X + (sp.sqrt((X - _B) ** 2 + _E**2) - sp.sqrt((X + _B) ** 2 + _E**2)) / 2
"""By how much the teeth are pressed together: zero in the gap, its edges rounded."""

LAW = joint_law(_K * (X - _TOUCH) - _K * _T * sp.diff(_TOUCH, X) * V, (_B, _K, _T, _E))
"""Takes back the spring -k x of the elastic joint where the teeth do not touch."""

CONTACT_RATE = 300.0
"""rad/s at which what the joint moves would swing on its closed teeth, where no compliance is
stated: far above what an arm does, low enough for steps of a fraction of a millisecond."""

CONTACT_TIME = 1e-4
"""s, retardation time of the teeth: they bounce off each other a few times and come to rest."""

EDGE = 3e-5
"""rad (m) over which the teeth meet: a hard edge would cost the simulation its order."""

TRIED_GAPS = (0.003, 0.01, 0.03, 0.1, 0.3)
"""Of the joint's travel."""

SMALLEST_GAP, LARGEST_GAP = 1e-4, 1.0
"""Of the joint's travel."""

PLACEHOLDER = 1e-3
"""rad: makes the structure; the size itself comes with the parameters."""


def _contact_compliance(arm: Arm, k: int) -> float:
    """rad/(N m) (m/N): an elastic joint keeps its own."""
    own = arm.segments[k].joint_compliance
    return own if own is not None else 1.0 / (CONTACT_RATE**2 * joint_load(arm, k))


class Backlash(Effect):
    """A dead zone in series with the contact's spring, on the twist of the joint."""

    kind = "backlash"
    location = "joint"
    title = "Backlash"
    story = (
        "The teeth of a gear have play. When the motor reverses, it first crosses the gap and "
        "moves nothing. Then the teeth meet with a knock. The encoder on the motor does not see "
        "it. The tip stays behind by up to half the gap, to one side or the other, and vibrates "
        "after each knock. Inside the gap nothing holds the arm."
    )
    formula = (
        r"\varphi_j = \theta_{arm} - \theta, \qquad "
        r"\tau = -k_j \begin{cases} 0 & |\varphi_j| < b_l \\ "
        r"\varphi_j - b_l \, \mathrm{sign}(\varphi_j) & \text{else} \end{cases}"
    )
    acts_at = "joints"
    ruled_out_by = "direct_drive"

    def changed_arm(self, arm: Arm, values: Values) -> Arm:
        return with_twisting_joints(
            arm,
            {k: values.get(f"bl{k + 1}", PLACEHOLDER) for k in range(arm.joints)},
            lambda k, size: _contact_compliance(arm, k),
        )

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        gaps = each_joint(
            arm, "bl", "half the gap of joint {}", lambda j: j.coordinate_unit,
            TRIED_GAPS[1] * sizes.travel, lower=SMALLEST_GAP * sizes.travel,
            upper=LARGEST_GAP * sizes.travel, grid=np.outer(sizes.travel, TRIED_GAPS),
        )  # fmt: skip
        return gaps + hub_parameters(arm, least=LEAST_LOAD, secondary=True)

    def elements(self, arm: Arm, p: np.ndarray, values: Values) -> tuple[Element, ...]:
        elements = []
        for k in range(arm.joints):
            place, gap = arm.twist_place(k), values[f"bl{k + 1}"]
            if place is not None and gap > 0.0:
                stiffness = float(p[slot(k, TWIST_STIFFNESS)])
                direction = np.eye(arm.coordinates)[place]
                elements.append(Element(LAW, (direction,), (gap, stiffness, CONTACT_TIME, EDGE)))
        return tuple(elements)
