"""What a person looks at, apart from the scenario itself."""

from __future__ import annotations

import math
from dataclasses import dataclass

STAGES = ("Arm", "Data", "Identify", "Compare", "Diagnose", "Export", "Study")
"""The stages of the work, in order."""


@dataclass(frozen=True)
class Live:
    """The sliders that belong to no scenario."""

    theta2: float = math.pi / 3.0
    """rad, the working point of the live model."""
    exaggeration: float = 10.0
    """How much larger the deflection is drawn."""
    snr_db: float | None = 20.0
    """Signal-to-noise ratio of what is simulated; None: no noise."""
    mode: int | None = None
    """The bending mode that is played, from 0."""


@dataclass(frozen=True)
class Cursor:
    """The time-line: one cursor for plots and arm."""

    recording: str = ""
    time: float = 0.0
    """s from the recording's first sample."""
    playing: bool = False
    speed: float = 1.0
    error: float = 1.0
    """How many times farther from the model the measured arm is drawn."""


@dataclass(frozen=True)
class Message:
    """A sentence for the person; the newest is shown."""

    text: str
    bad: bool = False
    number: int = 0
