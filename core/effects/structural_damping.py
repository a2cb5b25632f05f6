"""Damping in the material of the segments."""

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter, Rig
from ..effects.per_segment import arm_parameter, bending, unbent
from ..effects.sizes import Sizes

RATIO = 0.02
"""Damping ratio of the clamped segment at the start: that of a bolted or a plastic beam."""

LARGEST_DAMPING = 50.0
"""Times the start: a clamped segment at its critical damping."""


class StructuralDamping(Effect):
    """Kelvin-Voigt material: the bending damping is tau times the bending stiffness."""

    kind = "structural_damping"
    location = "segments"
    title = "Structural damping"
    story = (
        "Bending a beam back and forth warms it a little: the material resists the rate of "
        "bending, and vibrations decay. Without it the model keeps vibrating after every motion. "
        "The residual is a vibration at the arm's own frequencies that grows while the measured "
        "one decays. High frequencies decay first."
    )
    formula = r"M_b = EI \left( \delta'' + \tau \, \dot\delta'' \right)"
    linear = True
    dissipative = True
    acts_at = "segments"

    def not_applicable(self, rig: Rig) -> str:
        return unbent(rig)

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        def make(k: int) -> EffectParameter:
            own = arm.segments[k].damping_time
            step = 2.0 * RATIO / arm.segments[k].clamped_frequency
            return arm_parameter(arm, f"tau{k + 1}", step, 0.0, own + LARGEST_DAMPING * step)

        return tuple(make(k) for k in bending(arm))
