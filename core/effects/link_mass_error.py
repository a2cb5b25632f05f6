"""Segments that are heavier or lighter than stated."""

from ..arm.arm import Arm
from ..arm.catalogue import arm_parameters
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter
from ..effects.per_segment import arm_parameter
from ..effects.sizes import Sizes

START_MASS_ERROR = 0.1
BELIEVED = 0.3
"""Shares of the stated mass: where to begin, and how wrong that of a link can be whose bending
shows its stiffness over its mass. With more, every vibration ends in a minimum of its own."""


class LinkMassError(Effect):
    """The mass of each segment, in kg."""

    kind = "link_mass_error"
    location = "segments"
    title = "Wrong link mass"
    story = (
        "The segments differ in mass from the data sheet: screws, cables and paint add up, or the "
        "drawing is outdated. As with a payload, the arm's inertia is wrong, but the error is "
        "spread along the segments. Residual and missing joint torque therefore follow the "
        "acceleration in other proportions."
    )
    formula = r"m_k \leftarrow m_k + \Delta m_k"
    linear = True
    acts_at = "segments"

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        def make(k: int) -> EffectParameter:
            own = arm_parameters(arm)[f"m{k + 1}"]
            # That of a rigid link shows as it is, however large the slip in the data sheet.
            low, high = own.lower, own.upper
            if arm.modes[k]:
                low, high = (1.0 - BELIEVED) * own.value, (1.0 + BELIEVED) * own.value
            return arm_parameter(arm, own.name, START_MASS_ERROR * own.value, low, high)

        return tuple(make(k) for k in range(arm.joints))
