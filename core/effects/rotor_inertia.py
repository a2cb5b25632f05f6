"""The motor's rotor and the gear, seen from the joint."""

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter
from ..effects.joint_load import hub_parameters, rotor_parameters
from ..effects.sizes import Sizes


class RotorInertia(Effect):
    """Frees the arm's own inertias of hubs and rotors, whose names its parameters bear."""

    kind = "rotor_inertia"
    location = "joint"
    title = "Rotor inertia"
    story = (
        "Through a gear, the motor's rotor spins many times faster than the joint. Its inertia "
        "counts with the square of the gear ratio, so a small rotor can count as much as the arm. "
        "The missing joint torque, plotted over the joint's acceleration, is a straight line "
        "through zero. Without a gear (direct drive) the rotor is slow, and the rotation of the "
        "segment that carries it counts as well. The rotor then also loads the joint before it. "
        "Motion of both joints distinguishes the two cases."
    )
    formula = (
        r"T = \tfrac{1}{2} J_h \dot\theta^2 + \tfrac{1}{2} J_r (\omega + \dot\theta)^2, \qquad "
        r"\omega \text{: rate of the segment that carries the motor}"
    )
    linear = True
    acts_at = "joints"

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        return hub_parameters(arm) + rotor_parameters(arm)
