"""A base that gives way."""

import numpy as np

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter, Rig, Values
from ..effects.sizes import Sizes
from ..parameters import Parameter

START_HZ = 15.0
"""The arm as a dead mass on its base: a table that one sees shake."""

GRID_HZ = (240.0, 120.0, 60.0, 30.0, 15.0, 7.5)

RANGE = 1e3
"""Times the start, up and down: bases differ by orders of magnitude."""


def compliance(arm: Arm, hz: float) -> float:
    """m/N with which the arm's mass stands at `hz` Hz."""
    mass = sum(s.mass + s.tip_mass for s in arm.segments)
    return float(1.0 / (mass * (2.0 * np.pi * hz) ** 2))


class BaseCompliance(Effect):
    """Translation of the base, equally soft in both directions.

    Not part of the linear model: its y = C1 q is constant, while what a displacement of the base
    does to y turns with the posture.
    """

    kind = "base_compliance"
    location = "segments"
    title = "Soft base"
    story = (
        "The table under the arm is not rigid. When the arm accelerates, it pushes its base back, "
        "and the base vibrates. Camera and encoders then disagree even if nothing bends. The "
        "residual of the tip is a vibration, mostly across the arm. Its frequency depends little "
        "on the elbow angle."
    )
    formula = r"V \leftarrow V + \tfrac{1}{2 c_b} \left( b_1^2 + b_2^2 \right)"
    acts_at = "base"
    ruled_out_by = "rigid_base"

    def not_applicable(self, rig: Rig) -> str:
        stated = rig.arm.base_compliance is not None
        return "The arm stands on an elastic base already." if stated else ""

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        start = compliance(arm, START_HZ)
        parameter = Parameter(
            "cb", start, "m/N", start / RANGE, start * RANGE, "c_b", "base compliance", scale=start
        )
        return (EffectParameter(parameter, 0.0, tuple(compliance(arm, hz) for hz in GRID_HZ)),)

    def changed_arm(self, arm: Arm, values: Values) -> Arm:
        size = values.get("cb", compliance(arm, START_HZ))
        return arm.model_copy(update={"base_compliance": size}) if size else arm
