"""Rigs on which the joint torque is recorded and replayed, not made by a modelled loop."""

from __future__ import annotations

import numpy as np

from core.arm.slots import arm_vector
from core.effects.effect import Rig


def torque_is_replayed(rig: Rig) -> bool:
    """Whether the model takes its torque from the recording: nothing is fed back, or a servo is."""
    law = rig.drive.law(rig.arm, arm_vector(rig.arm), {})
    return rig.servo or not (np.any(law.P) or np.any(law.V) or law.states)
