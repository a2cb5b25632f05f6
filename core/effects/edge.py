"""Over which speed the sign of a velocity changes in a friction law."""

from __future__ import annotations

from core.arm.joints import joint
from core.arm.segment import Segment

_EDGES = {"rad": 5e-4, "m": 1e-4}
"""rad/s and m/s: far below the speeds of an experiment, so that the friction of a joint at rest is
what a creep of this size makes of it. On a slide of a published benchmark an edge of 2e-3 m/s
moves the friction coefficients by 2 %, one of 1e-4 m/s by less than half a per cent; on an arm
whose joints stick, simulated by another engine, one of 2e-3 rad/s moves them by 7 and 17 %."""


def edge(segment: Segment) -> float:
    """rad/s, or m/s on a slide."""
    return _EDGES[joint(segment.joint).coordinate_unit]
