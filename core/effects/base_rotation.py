"""A base that turns under the first joint."""

import numpy as np

from ..arm.arm import Arm, Pedestal
from ..drives.drive import Drive
from ..effects.base_compliance import GRID_HZ, RANGE, START_HZ
from ..effects.effect import Effect, EffectParameter, Rig, Values
from ..effects.joint_load import HEAVIEST, joint_load
from ..effects.sizes import Sizes
from ..parameters import Parameter

START_SHARE = 0.3
"""Of what joint 1 moves: the housing of its motor with the column below."""


def compliance(arm: Arm, hz: float) -> float:
    """rad/(N m) with which the stretched arm swings at `hz` Hz, the motor held."""
    return float(1.0 / (joint_load(arm, 0) * (2.0 * np.pi * hz) ** 2))


class BaseRotation(Effect):
    """Adds the angle of a pedestal, with a spring and an inertia, below the first joint.

    Not part of the linear model, for the reason of the soft base: y is in a frame that turns.
    """

    kind = "base_rotation"
    location = "segments"
    title = "Turning base"
    story = (
        "The column or the table under joint 1 twists when the motor accelerates the arm: the "
        "motor pushes against it with the same torque. The encoder measures the joint relative to "
        "the column and does not see that, the camera does. An elastic joint looks alike, but "
        "there only the arm yields, while here the motor's housing turns as well. The inertia of "
        "the column separates the two; without it a turning base acts as an elastic joint."
    )
    special_cases = ("joint_elasticity",)  # one joint, and a column without inertia
    formula = r"\theta_{arm} = \theta_1 + \beta, \qquad J_p \ddot\beta + \beta / c_p = -\tau_1"
    acts_at = "base"
    ruled_out_by = "rigid_base"

    def not_applicable(self, rig: Rig) -> str:
        if rig.arm.pedestal is not None:
            return "The arm stands on a turning base already."
        slides = rig.arm.segments[0].joint != "revolute"
        return "The first joint slides, so that its motor turns no base." if slides else ""

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        start, load = compliance(arm, START_HZ), joint_load(arm, 0)
        inertia = START_SHARE * load
        # A heavier column shows nothing but its own frequency, as a machine nearby does.
        spring = Parameter(
            "cp", start, "rad/(N m)", start / RANGE, start * RANGE, "c_p",
            "compliance of the pedestal", scale=start,
        )  # fmt: skip
        turning = Parameter(
            "Jp", inertia, "kg m²", inertia / RANGE, HEAVIEST * load, "J_p",
            "inertia of the pedestal", scale=inertia,
        )  # fmt: skip
        grid = tuple(compliance(arm, hz) for hz in GRID_HZ)
        return (
            EffectParameter(spring, 0.0, grid), EffectParameter(turning, inertia, secondary=True)
        )  # fmt: skip

    def changed_arm(self, arm: Arm, values: Values) -> Arm:
        size = values.get("cp", compliance(arm, START_HZ))
        inertia = values.get("Jp", START_SHARE * joint_load(arm, 0))
        if not size:
            return arm
        return arm.model_copy(update={"pedestal": Pedestal(compliance=size, inertia=inertia)})
