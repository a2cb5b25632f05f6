"""Whether what is stated of the links can be of one arm, and of the one that was recorded."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.segment import CLAMPED
from flexgui.sentences.written import format_number, with_unit

if TYPE_CHECKING:
    from flexgui.core.recording.recording import Recording

TOO_LONG = 30.0
"""Times the distance of the recorded tip from the base: a link as long as that is in another unit.
An arm that only moves a little beside a camera of its own frame stays below."""
MASSES = (1e-3, 2e3)
"""kg/m: a thin wire, and a solid bar of steel, half a metre thick."""
HIGHEST = 5e3
"""Hz: a link that bends above is one that nobody calls flexible."""
SEEN = 99.0
"""Percentile of the distances: a camera has outliers."""


def contradiction(arm: Arm, tip: float | None) -> str:
    """One sentence on the first number that cannot be, with what to do; empty where there is none.

    Args:
        arm: As stated.
        tip: m, how far from the base the tip was recorded (see `tip_distance`); None: it was not.
    """
    return next(_contradictions(arm, tip), "")


def _contradictions(arm: Arm, tip: float | None) -> Iterator[str]:
    for k, link in enumerate(arm.segments, 1):
        length, mass = _text(link.length, "m"), _text(link.mass, "kg")
        if tip and link.length > TOO_LONG * tip:
            yield (
                f"Length of link {k}: {length}, but the recorded tip is at most {_text(tip, 'm')} "
                "from the base; state it in m."
            )
        per_metre = link.mass / link.length
        if link.joint == "revolute" and not MASSES[0] <= per_metre <= MASSES[1]:
            yield (
                f"Mass of link {k}: {mass} on a length of {length} are {_text(per_metre, 'kg/m')}, "
                "which no link has; state the mass in kg and the length in m."
            )
        lowest = CLAMPED * math.sqrt(link.bending_stiffness / link.mass / link.length**3) / math.tau
        if lowest > HIGHEST:
            yield (
                f"Stiffness EI of link {k}: {_text(link.bending_stiffness, 'N m²')}, but with its "
                f"mass and length it would not bend below {_text(lowest, 'Hz')}; state it in N m², "
                "or leave it empty for a rigid link."
            )


def _text(value: float, unit: str) -> str:
    return with_unit(format_number(value, 2 if unit == "Hz" else 3), unit)


def tip_distance(recording: Recording | None) -> float | None:
    """m, how far from the base a recording's tip is at most; None where it was not recorded."""
    if recording is None or not recording.has("z1", "z2"):
        return None
    distances = np.hypot(recording["z1"], recording["z2"])
    seen = distances[np.isfinite(distances)]
    return float(np.percentile(seen, SEEN)) if seen.size else None
