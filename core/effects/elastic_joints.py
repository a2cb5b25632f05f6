"""The structure of an arm whose joints twist between motor and segment."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from core.arm.arm import Arm
from core.effects.joint_load import LEAST, joint_load


def with_twisting_joints(
    arm: Arm, sizes: Mapping[int, float], compliance: Callable[[int, float], float]
) -> Arm:
    """The arm with the joints (from 0) whose size is above zero made elastic.

    `compliance(k, size)` is in rad/(N m) (m/N). The motor of such a joint gets a hub of
    at least LEAST times what the joint moves.
    """
    segments = list(arm.segments)
    for k, size in sizes.items():
        if size > 0.0:
            s = segments[k]
            hub = max(s.hub_inertia, LEAST * joint_load(arm, k))
            update = {"joint_compliance": compliance(k, size), "hub_inertia": hub}
            segments[k] = s.model_copy(update=update)
    return arm.model_copy(update={"segments": tuple(segments)})
