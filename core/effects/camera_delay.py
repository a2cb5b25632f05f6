"""A camera whose pictures are older than their time stamps."""

import numpy as np
import scipy

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter, Rig, Values
from ..effects.per_joint import sized
from ..effects.sizes import Sizes
from ..sensors import sensors

START_DELAY, LONGEST_DELAY = 5.0, 200.0
"""In sample times."""


def no_camera(rig: Rig) -> str:
    """The sentence for an effect of the camera; empty where its outputs are compared."""
    return "" if rig.camera else "No output of a camera is compared."


class CameraDelay(Effect):
    """Smooth in the delay, also at zero, so it needs no scan: a spline through the samples."""

    kind = "camera_delay"
    location = "sensors"
    title = "Camera delay"
    story = (
        "A picture must be exposed, sent and searched for the target. Its value arrives late but "
        "is stored beside the encoder's newest value. The measured tip lags behind the model by a "
        "fixed time. The residual looks like the tip's velocity with the opposite sign."
    )
    formula = r"z_{\mathrm{measured}}(t) = z(t - t_d)"
    linear = True
    acts_at = "camera"
    ruled_out_by = "camera_synchronised"

    def not_applicable(self, rig: Rig) -> str:
        return no_camera(rig)

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        start = START_DELAY * sizes.sample_time
        most = LONGEST_DELAY * sizes.sample_time
        return (sized("td", start, "s", "delay of the camera", upper=most),)

    def sensed(self, sensor: str, y: np.ndarray, dt: float, values: Values) -> np.ndarray:
        if not values["td"] or not sensors()[sensor].from_camera:
            return y
        t = np.arange(len(y)) * dt
        # Before the first sample the arm stands.
        earlier = np.clip(t - values["td"], 0.0, t[-1])
        return np.asarray(scipy.interpolate.CubicSpline(t, y)(earlier))
