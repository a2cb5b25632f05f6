"""The factors that geometry and dynamics blame, as one list for the checks that name them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.check.case import Case
from core.check.checks.swapped_joints import SwappedJoints
from core.check.geometry import DEGREES, MILLI

UNIT = 0.15
"""Share within which a factor is that of a unit."""


@dataclass(frozen=True)
class Blamed:
    """A channel that is `factor` times what others say; negative: it counts backwards."""

    channel: str
    factor: float
    against: str
    expected: np.ndarray | None = None

    def near(self, wanted: float, share: float) -> bool:
        """Whether the factor is `wanted`, but for a share of it."""
        return abs(self.factor / wanted - 1.0) < share


def blamed(case: Case) -> list[Blamed]:
    """Factors of the geometry first; those of the dynamics where it has nothing to say of them."""
    found = [
        Blamed(name, one.factor, "the camera" if name.startswith("theta") else "the encoders")
        for one in case.misfits
        for name in one.channels
        if one.factor != 1.0
    ]
    known = {name for one in case.misfits for name in one.channels}
    if any(True for _ in SwappedJoints().look(case)):
        return found
    return found + [
        Blamed(one.channel, one.factor, one.against or "the others", one.expected)
        for one in case.suspects
        if one.factor != 1.0 and one.channel not in known
    ]


def other_units(one: Blamed) -> bool:
    """Whether a check of a unit names it."""
    angle = one.channel.startswith(("theta", "dtheta"))
    length = not one.channel.startswith(("y", "i"))
    return (angle and one.near(DEGREES, UNIT / 2)) or (length and one.near(MILLI, UNIT))
