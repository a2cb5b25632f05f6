"""A channel whose numbers are older, or newer, than those beside them."""

from __future__ import annotations

import numpy as np
import scipy

from ..effects.effect import EffectParameter, Values
from ..effects.per_channel import ChannelEffect
from ..effects.per_joint import sized
from ..effects.sizes import Sizes

START_DELAY, LONGEST_DELAY = 3.0, 100.0
"""In sample times: a value that waits for a bus is some samples old."""


class SensorDelay(ChannelEffect):
    """A delay per channel against the columns that drive the model: references, or torques.

    Of either sign, because those columns may be late themselves; positive is late. Smooth in the
    delay, also at zero, so it needs no scan: a spline through the samples. Where a virtual
    servo holds the joints on the encoders, they are put back to when they were true.
    """

    kind = "sensor_delay"
    location = "sensors"
    title = "Delay of one sensor against the others"
    story = (
        "Each sensor has its own electronics, and a bus reads one after the other. The values in "
        "one row do not belong to the same moment. Two encoders of one axis, read some "
        "milliseconds apart, differ while the axis turns. The difference is the speed times the "
        "delay, as if a soft spring were between them. But it does not vibrate and does not "
        "depend on the load. The residual of the late channel looks like its own rate of change "
        "with the opposite sign."
    )
    formula = r"y_{k,\mathrm{measured}}(t) = y_k(t - t_k)"
    linear = True
    acts_at = "joints"
    letter = "t"

    def parameter(self, name: str, channel: str, sizes: Sizes) -> EffectParameter:
        start, most = START_DELAY * sizes.sample_time, LONGEST_DELAY * sizes.sample_time
        return sized(name, start, "s", f"delay of {channel}", signed=True, upper=most)

    def followed(self, joints: np.ndarray, dt: float, values: Values) -> np.ndarray:
        return _late(joints, dt, -self.columns_of("encoder", values))

    def sensed(self, sensor: str, y: np.ndarray, dt: float, values: Values) -> np.ndarray:
        return _late(y, dt, self.columns_of(sensor, values))


def _late(y: np.ndarray, dt: float, delays: np.ndarray) -> np.ndarray:
    """(N, k) with each column later by its delay (k,) in s; it stands still beyond both ends."""
    if not np.any(delays):
        return y
    t, out = np.arange(len(y)) * dt, y.copy()
    for k in np.flatnonzero(delays):
        out[:, k] = scipy.interpolate.CubicSpline(t, y[:, k])(np.clip(t - delays[k], 0.0, t[-1]))
    return out
