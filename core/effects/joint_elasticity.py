"""A gear that gives way between the motor and the arm."""

import numpy as np

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter, Values
from ..effects.joint_load import LEAST_LOAD, hub_parameters, rotor_parameters, with_twisting_joints
from ..effects.per_joint import each_joint
from ..effects.sizes import Sizes

TWISTS = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 3e-1)
"""rad (m): by how much the joint twists at the largest torque."""

LEAST_TWIST, MOST_TWIST = 1e-6, 1.0
"""rad (m) at the largest torque."""

PLACEHOLDER = 1e-4
"""rad/(N m): makes the structure; the size itself comes with the parameters."""


class JointElasticity(Effect):
    """Adds the twist of every joint to the coordinates of the arm."""

    kind = "joint_elasticity"
    location = "joint"
    title = "Elastic joint"
    story = (
        "A gear, a belt or a long shaft is a spring: the motor turns first, the arm follows and "
        "vibrates. The encoder sits on the motor and does not see the twist; camera and strain "
        "gauges do. The tip is off by an angle proportional to the torque. The arm vibrates more "
        "slowly than its beams alone would. A softer beam looks similar; several postures "
        "distinguish the two."
    )
    formula = r"\theta_{arm} = \theta + \varphi_j, \qquad \varphi_j = -c \, \tau"
    includes = ("rotor_inertia",)
    linear = True
    acts_at = "joints"
    ruled_out_by = "direct_drive"

    def changed_arm(self, arm: Arm, values: Values) -> Arm:
        sizes = {k: values.get(f"c{k + 1}", PLACEHOLDER) for k in range(arm.joints)}
        return with_twisting_joints(arm, sizes, lambda k, size: size)

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        grid = np.array(TWISTS) / sizes.peak_torque[:, None]
        twists = each_joint(
            arm, "c", "compliance of joint {}", lambda j: j.compliance_unit, grid[:, 2],
            lower=LEAST_TWIST / sizes.peak_torque, upper=MOST_TWIST / sizes.peak_torque, grid=grid,
        )  # fmt: skip
        motors = hub_parameters(arm, least=LEAST_LOAD, secondary=True)
        return twists + motors + rotor_parameters(arm, secondary=True)
