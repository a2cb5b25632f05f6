"""Helps for effects with one parameter per channel of the sensors that have clocks and scales of
their own: all but the camera's, which has effects of its own.

A parameter's name is the effect's letter, the letter of the sensor and the number of the channel:
te1 is the delay of the first encoder.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from ..arm.arm import Arm
from ..effects.effect import Effect, EffectParameter, Rig, Values, torque_is_replayed
from ..effects.sizes import typical
from ..recording.channels import channel_number
from ..sensors import sensors

TORQUE = "torque"


def _names(letter: str, arm: Arm) -> dict[str, tuple[str, str]]:
    """Name of a parameter -> kind of sensor, words for the channel."""
    found = {}
    for kind, sensor in sensors().items():
        if sensor.from_camera or not sensor.defined_on(arm):
            continue
        for channel in sensor.channels(arm):
            own = f"{sensor.letter or kind}{channel_number(channel.name)}"
            words = f"{sensor.called or sensor.title} {channel_number(channel.name)}"
            found[letter + own] = kind, words
    return found


def each_channel(
    letter: str,
    arm: Arm,
    make: Callable[[str, str], EffectParameter],
    ruled_out_by: Mapping[str, str] | None = None,
) -> tuple[EffectParameter, ...]:
    """One parameter per channel, `make(name, words for the channel)`; `ruled_out_by`: kind of
    sensor -> the statement about the rig under which its channels' stay neutral."""
    statements = ruled_out_by or {}
    return tuple(
        replace(make(name, words), separate=True, ruled_out_by=statements.get(kind, ""))
        for name, (kind, words) in _names(letter, arm).items()
    )


def columns_of(letter: str, kind: str, values: Values) -> np.ndarray:
    """(k,) the values of a kind of sensor's channels in their order; (0,) where it has none."""
    sensor = sensors()[kind]
    names = (
        [] if sensor.from_camera else [f"{letter}{sensor.letter or kind}{k}" for k in "123456789"]
    )
    return np.array([values[name] for name in names if name in values], dtype=float)


def compared_in(letter: str, name: str, rig: Rig) -> bool:
    """Whether a rig can show the parameter of that name.

    Torques that are replayed drive the model, so nothing of theirs is measured; encoders that a
    virtual servo follows are seen through it.
    """
    kind = _names(letter, rig.arm)[name][0]
    if kind == TORQUE:
        return kind in rig.outputs and not torque_is_replayed(rig)
    return kind in rig.outputs or (kind == "encoder" and rig.servo)


def nothing_to_see(effect: Effect, letter: str, rig: Rig) -> str:
    """The sentence for a rig on which no channel of these is compared; empty where one is."""
    quantities = effect.parameters(rig.arm, rig.drive, typical(rig.arm))
    if any(compared_in(letter, quantity.parameter.name, rig) for quantity in quantities):
        return ""
    return "No encoder, strain gauge or measured torque is compared; the camera has its own effect."
