"""A camera that is turned or has the wrong scale."""

import numpy as np

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..effects.camera_delay import no_camera
from ..effects.effect import Effect, EffectParameter, Rig, Values
from ..effects.per_joint import sized
from ..effects.sizes import Sizes

START_MISALIGNMENT, LARGEST_MISALIGNMENT = 0.01, 0.5
"""rad, and share of the scale."""


class CameraMisalignment(Effect):
    """A rotation and a scale of the tip's place about the origin, where z itself is compared."""

    kind = "camera_misalignment"
    location = "sensors"
    title = "Camera turned or wrongly scaled"
    story = (
        "The camera is slightly rotated, or a pixel is not exactly as large as assumed. All tip "
        "positions are then rotated about the base or scaled by the same factor. The residual is "
        "present even at rest. It depends on where the tip is, not on how it moves."
    )
    formula = r"z_{\mathrm{measured}} = (1 + c_s) \, R(c_a) \, z"
    linear = True
    acts_at = "camera"

    def not_applicable(self, rig: Rig) -> str:
        if "z" in rig.outputs or not rig.camera:
            return no_camera(rig)
        return "The tip positions (z) are not compared; angles computed from them hide this effect."

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        turn, scale = "rotation of the camera", "error of the camera's scale"
        return (
            sized("ca", START_MISALIGNMENT, "rad", turn, signed=True, upper=LARGEST_MISALIGNMENT),
            sized("cs", START_MISALIGNMENT, "", scale, signed=True, upper=LARGEST_MISALIGNMENT),
        )

    def sensed(self, sensor: str, y: np.ndarray, dt: float, values: Values) -> np.ndarray:
        turn, scale = values["ca"], values["cs"]
        if sensor != "z" or (turn == 0.0 and scale == 0.0):
            return y
        c, s = np.cos(turn), np.sin(turn)
        return np.asarray((1.0 + scale) * y @ np.array([[c, s], [-s, c]]))
