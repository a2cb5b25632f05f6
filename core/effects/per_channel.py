"""What effects with one parameter per channel have in common, of the sensors that have clocks and
scales of their own: all but the camera's, which has effects of its own.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..arm.arm import Arm
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter, Rig, Values, torque_is_replayed
from ..effects.sizes import Sizes
from ..sensors import sensors
from ..sensors.link_sensor import SECOND

TORQUE = "torque"

TRAILING = f"123{SECOND}"
"""What may end a channel's name: the number of its joint, and the mark of a second sensor."""
NUMBERS = ("1", "2", "3", *(f"{k}{SECOND}" for k in "123"))
"""In the order of a sensor's channels."""


class ChannelEffect(Effect):
    """A parameter's name is the effect's letter, the letter of the sensor and the number of the
    channel: te1 is the delay of the first encoder."""

    letter: str = ""
    exact_by: Mapping[str, str] = {}
    """Kind of sensor -> the statement of `[rig]` under which its channels have no such effect."""

    @abstractmethod
    def parameter(self, name: str, channel: str, sizes: Sizes) -> EffectParameter:
        """Of one channel, which is given in words."""

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        return tuple(
            replace(
                self.parameter(name, channel, sizes),
                separate=True,
                ruled_out_by=self.exact_by.get(kind, ""),
            )
            for name, (kind, channel, _) in self._names(arm).items()
        )

    def not_applicable(self, rig: Rig) -> str:
        shown = any(self.shown(name, rig) for name in self._names(rig.arm))
        others = "the camera has its own effect."
        return "" if shown else f"No encoder, strain gauge or measured torque is compared; {others}"

    def shown(self, name: str, rig: Rig) -> bool:
        """Torques that are replayed drive the model, so nothing of theirs is measured; encoders
        that a virtual servo follows are seen through it."""
        kind = self._names(rig.arm)[name][0]
        if kind == TORQUE:
            return kind in rig.outputs and not torque_is_replayed(rig)
        return kind in rig.outputs or (kind == "encoder" and rig.servo)

    def columns_of(self, kind: str, values: Values) -> np.ndarray:
        """(k,) the values of a kind of sensor's channels in their order; (0,) where it has none."""
        sensor = sensors()[kind]
        stem = self.letter + (sensor.letter or kind)
        names = [] if sensor.from_camera else [f"{stem}{k}" for k in NUMBERS]
        return np.array([values[name] for name in names if name in values], dtype=float)

    def _names(self, arm: Arm) -> dict[str, tuple[str, str, str]]:
        """Name of a parameter -> kind of sensor, words for the channel, the channel."""
        names = {}
        for kind, sensor in sensors().items():
            if sensor.from_camera or not sensor.defined_on(arm):
                continue
            for channel in sensor.channels(arm):
                number = channel.name[len(channel.name.rstrip(TRAILING)) :]
                label = f"{sensor.called or sensor.title} {number}"
                name = f"{self.letter}{sensor.letter or kind}{number}"
                names[name] = kind, label, channel.name
        return names
