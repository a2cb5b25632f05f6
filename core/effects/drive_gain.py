"""A loop whose gain, or a motor whose torque constant, is not the stated one."""

from dataclasses import replace

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter, Rig
from ..effects.sizes import Sizes

START_GAIN_ERROR = 0.1
"""Of the stated gain: torque constants on data sheets are good to a tenth."""

FURTHEST = 2.0
"""Times the stated gain, and as a share of it: a warm or aged magnet, a loop in other units of the
same size. A much smaller constant shrinks measured and modelled torque alike, and would explain
any error away."""


class DriveGain(Effect):
    """Frees the drive's own parameters, whose names its parameters bear."""

    kind = "drive_gain"
    location = "drive"
    title = "Gain of the drive"
    story = (
        "A loop's gain is entered into a controller in the controller's own units. A motor's "
        "torque constant is copied from a data sheet, but magnets differ and get weaker when "
        "warm. With less gain than stated, a joint yields more when pushed and follows its "
        "reference less closely. With a wrong torque constant, every torque is too large or too "
        "small by the same share. The missing joint torque, plotted over the commanded torque, is "
        "a straight line through zero."
    )
    formula = r"u = (1 + \gamma) \, u_{\mathrm{stated}}"
    linear = True
    acts_at = "drive"

    def not_applicable(self, rig: Rig) -> str:
        if self.parameters_of_drive(rig.drive, rig.arm):
            return ""
        return "The drive has neither a gain nor a torque constant that could differ."

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        return self.parameters_of_drive(drive, arm)

    @staticmethod
    def parameters_of_drive(drive: Drive, arm: Arm) -> tuple[EffectParameter, ...]:
        """One per parameter of the drive; a gain that is stated as zero is switched off."""
        return tuple(
            EffectParameter(
                replace(
                    item,
                    value=(1.0 + START_GAIN_ERROR) * item.value,
                    lower=item.value / FURTHEST,
                    upper=item.value * FURTHEST,
                ),
                neutral=item.value,
            )
            for item in drive.parameters(arm)
            if item.value > 0.0
        )
