"""The motor's rotor and the gear, seen from the joint."""

from core.arm.arm import Arm
from core.drives.drive import Drive
from core.effects.effect import Effect, EffectParameter
from core.effects.joint_load import hub_parameters
from core.effects.sizes import Sizes


class RotorInertia(Effect):
    """Frees the arm's own hub inertias, whose names its parameters bear."""

    kind = "rotor_inertia"
    location = "joint"
    title = "Rotor inertia"
    story = (
        "Inside the motor a rotor spins, through a gear many times faster than the joint, and its "
        "inertia counts with the square of the gear ratio. A small rotor can weigh as much as the "
        "arm. The missing joint torque, drawn over the joint's acceleration, is a straight line "
        "through zero."
    )
    formula = r"\tau = -J_h \, \ddot\theta"
    linear = True
    acts_at = "joints"

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        return hub_parameters(arm, neutral=[s.hub_inertia for s in arm.segments])
