"""Helps for effects with one parameter per channel of encoders, gauges and motor currents.

A parameter's name is the effect's letter, the letter of the kind of sensor and the number of the
joint or segment: te1 is the delay of the first encoder.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from core.arm.arm import Arm
from core.effects.effect import Effect, EffectParameter, Rig, Values, torque_is_replayed
from core.effects.sizes import typical

LETTERS = {"encoder": "e", "deflection": "g", "torque": "u", "link_encoder": "l"}
"""Kind of output -> the letter of its channels: encoders, gauges, currents, encoders on the links.
The camera has effects of its own."""

CALLED = {
    "encoder": "encoder",
    "deflection": "gauge",
    "torque": "the measured torque of motor",
    "link_encoder": "link-side encoder",
}

MOST_JOINTS = 9


def each_channel(
    letter: str, arm: Arm, make: Callable[[str, str, str], EffectParameter]
) -> tuple[EffectParameter, ...]:
    """One parameter per channel, `make(name, words for the channel, symbol)`."""
    found = []
    for kind, own in LETTERS.items():
        for k in range(arm.joints):
            if kind == "deflection" and not arm.modes[k]:
                continue
            symbol = rf"{letter}_{{{own}{k + 1}}}"
            made = make(f"{letter}{own}{k + 1}", f"{CALLED[kind]} {k + 1}", symbol)
            found.append(replace(made, separate=True))
    return tuple(found)


def columns_of(letter: str, sensor: str, values: Values) -> np.ndarray:
    """(k,) the values of a kind of sensor's channels in their order; (0,) where it has none."""
    own = LETTERS.get(sensor)
    names = [f"{letter}{own}{k + 1}" for k in range(MOST_JOINTS)] if own else []
    return np.array([values[name] for name in names if name in values], dtype=float)


def compared_in(letter: str, name: str, rig: Rig) -> bool:
    """Whether a rig can show the parameter of that name.

    Torques that are replayed drive the model, so nothing of theirs is measured; encoders that a
    virtual servo follows are seen through it.
    """
    own = name.removeprefix(letter)[:1]
    kind = next(kind for kind, each in LETTERS.items() if each == own)
    if kind == "torque":
        return kind in rig.outputs and not torque_is_replayed(rig)
    return kind in rig.outputs or (kind == "encoder" and rig.servo)


def nothing_to_see(effect: Effect, letter: str, rig: Rig) -> str:
    """The sentence for a rig on which no channel of these is compared; empty where one is."""
    quantities = effect.parameters(rig.arm, rig.drive, typical(rig.arm))
    if any(compared_in(letter, quantity.parameter.name, rig) for quantity in quantities):
        return ""
    return "No encoder, strain gauge or measured torque is compared; the camera has its own effect."
