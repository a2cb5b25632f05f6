"""A gauge, an encoder or a current whose scale is not the stated one."""

from __future__ import annotations

import numpy as np

from ..effects.effect import EffectParameter, Rig, Values
from ..effects.per_channel import ChannelEffect
from ..effects.per_joint import sized
from ..effects.sizes import Sizes

START_GAIN_ERROR = 0.05
"""Share of the scale: a strain gauge that nobody calibrated is easily off by that."""

LEAST, MOST = -0.5, 1.0
"""Half to twice: a factor of two is the largest slip of an amplifier's or a bridge's setting; what
is further off is a unit or a gear ratio, a question of the recording and no size to be fitted.
Wider, a scale takes up friction: an encoder that is wrong by four fits better than none at all."""


class SensorGain(ChannelEffect):
    """Measured = (1 + gain) times true, per channel.

    An encoder's scale also says where the joints start and what a virtual servo follows. A loop
    that feeds the encoder back is left as it is: its gain is `drive_gain`. So is the scale of a
    torque that is replayed.
    """

    kind = "sensor_gain"
    location = "sensors"
    title = "Wrong scale of a sensor"
    story = (
        "A strain gauge is glued and its amplifier set by hand. A current is measured as the "
        "voltage over a resistor. An encoder's counts per turn or a gear ratio are read off a "
        "label. If such a factor is wrong, every value of that channel is too large or too small "
        "by the same share. This holds at every speed and in every posture; the other channels "
        "are not affected. The residual looks like the signal itself, made smaller. A soft link "
        "would change the other sensors too."
    )
    formula = r"y_{k,\mathrm{measured}} = (1 + g_k) \, y_k"
    linear = True
    acts_at = "joints"
    letter = "g"
    exact_by = {
        "deflection": "gauges_calibrated",
        "strain": "gauges_calibrated",
        "encoder": "encoders_calibrated",
        "link_encoder": "encoders_calibrated",
    }

    def parameter(self, name: str, channel: str, sizes: Sizes) -> EffectParameter:
        title = f"error of the scale of {channel}"
        return sized(name, START_GAIN_ERROR, "", title, lower=LEAST, upper=MOST)

    def shown(self, name: str, rig: Rig) -> bool:
        """A gain that is estimated anyhow has no error."""
        return super().shown(name, rig) and self._names(rig.arm)[name][2] not in rig.estimated_gains

    def started(self, joints: np.ndarray, values: Values) -> np.ndarray:
        scale = self._scale("encoder", values)
        return joints / scale if np.any(scale != 1.0) else joints

    def followed(self, joints: np.ndarray, dt: float, values: Values) -> np.ndarray:
        return self.started(joints, values)

    def sensed(self, sensor: str, y: np.ndarray, dt: float, values: Values) -> np.ndarray:
        scale = self._scale(sensor, values)
        return y * scale if np.any(scale != 1.0) else y

    def _scale(self, sensor: str, values: Values) -> np.ndarray:
        """(k,) one plus the gains of a kind of sensor's channels; (0,) for a kind that has none."""
        return 1.0 + self.columns_of(sensor, values)
