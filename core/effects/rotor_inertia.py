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
        "Inside the motor a rotor spins, through a gear many times faster than the joint, and its "
        "inertia counts with the square of the gear ratio. A small rotor can weigh as much as the "
        "arm. The missing joint torque, drawn over the joint's acceleration, is a straight line "
        "through zero. Without a gear, in a direct drive, the rotor is slow, and the turning of "
        "the segment that carries it counts as well: it is heavy to swing from the joint before "
        "too. Which of the two it is shows when both joints move."
    )
    formula = (
        r"T = \tfrac{1}{2} J_h \dot\theta^2 + \tfrac{1}{2} J_r (\omega + \dot\theta)^2, \qquad "
        r"\omega \text{: rate of the segment that carries the motor}"
    )
    linear = True
    acts_at = "joints"

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        return hub_parameters(arm) + rotor_parameters(arm)
