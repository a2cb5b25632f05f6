"""What an effect does to an arm, as it is shown to a person."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.effects.over_speed import OverSpeed
from core.parameters import Parameter


@dataclass(frozen=True)
class Demonstration:
    """One output of one recording, where the effect changes it most."""

    kind: str
    title: str
    recording: str
    channel: str
    unit: str
    time: np.ndarray
    """(N,) s, a stretch of the recording"""
    measured: np.ndarray
    without: np.ndarray
    """(N,) of the model with everything else in it"""
    with_it: np.ndarray
    sizes: tuple[Parameter, ...]
    """Of the effect, at the values that were simulated."""
    floor: float | None = None
    """Of the output's error, where it is known."""
    torques: tuple[OverSpeed, ...] = ()
    """What the effect does to each joint, over its speed; empty where no such law says it."""
