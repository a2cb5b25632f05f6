"""Slow electronics between a sensor and its numbers."""

import numpy as np
import scipy

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter, Rig, Values
from ..effects.per_joint import sized
from ..effects.sizes import Sizes
from ..sensors import sensors

START_LAG, LONGEST_LAG = 5.0, 200.0
"""In sample times."""


class SensorLag(Effect):
    """Smooth in the time constant, also at zero, where its slope is that of a delay: no scan.

    The same time constant for camera and strain gauges, as with one data logger; a rig compares
    one of them as a rule.
    """

    kind = "sensor_lag"
    location = "sensors"
    title = "Slow sensor"
    story = (
        "Amplifiers and cameras average over a short time. A first-order lag follows slow motion "
        "closely and attenuates fast vibration; a pure delay keeps its amplitude. The residual "
        "looks like the signal's velocity. But at high frequencies the measured vibration is "
        "smaller than the model's."
    )
    formula = r"t_s \, \dot y_{\mathrm{measured}} + y_{\mathrm{measured}} = y"
    linear = True
    acts_at = "camera"

    def not_applicable(self, rig: Rig) -> str:
        if any(sensors()[kind].slow for kind in rig.outputs):
            return ""
        return "Neither a camera's nor a strain gauge's output is compared."

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        start = START_LAG * sizes.sample_time
        most = LONGEST_LAG * sizes.sample_time
        return (sized("ts", start, "s", "lag of the sensor", upper=most),)

    def sensed(self, sensor: str, y: np.ndarray, dt: float, values: Values) -> np.ndarray:
        if not values["ts"] or not sensors()[sensor].slow:
            return y
        return first_order(y, dt, values["ts"])


def first_order(y: np.ndarray, dt: float, time_constant: float) -> np.ndarray:
    """(N, k) signals y (N, k), `dt` s apart, after a lag of `time_constant` s: exact where they run
    straight between samples; starts settled."""
    ratio = time_constant / dt
    kept = np.exp(-1.0 / ratio)
    now, before = 1.0 - ratio * (1.0 - kept), ratio * (1.0 - kept) - kept
    steady = (kept + before) * y[:1]
    out, _ = scipy.signal.lfilter([now, before], [1.0, -kept], y, axis=0, zi=steady)
    return np.asarray(out)
