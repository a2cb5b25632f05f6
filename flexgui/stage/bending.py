"""How much larger the bending of a recording is drawn, so that it is seen and looks like an arm."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from core.arm.arm import Arm
from flexgui.stage.geometry import ArmGeometry

SHARE = 0.09
"""Of the reach: so far the tip is drawn from where a stiff arm had it, at the most."""
FACTORS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
FRAMES = 400
"""Looked at; the bending swings slowly enough."""


def largest_deflection(arm: Arm, p: np.ndarray, q: np.ndarray) -> float:
    """m between the tip and that of a stiff arm, over postures q (N, n)."""
    if arm.coordinates == arm.joints or not len(q):
        return 0.0
    some = q[:: max(len(q) // FRAMES, 1)]
    stiff = some.copy()
    stiff[:, arm.joints :] = 0.0
    geometry = ArmGeometry(arm, p)
    return float(np.max(np.linalg.norm(geometry.tips(some) - geometry.tips(stiff), axis=1)))


def fitting_factor(arm: Arm, p: np.ndarray, q: np.ndarray) -> float:
    """The one of FACTORS that draws the largest deflection nearest to SHARE of the reach."""
    bent = largest_deflection(arm, p, q)
    if not np.isfinite(bent) or bent <= 0.0:
        return FACTORS[0]
    wanted = SHARE * ArmGeometry(arm, p).reach / bent
    limits = [np.sqrt(a * b) for a, b in pairwise(FACTORS)]
    return FACTORS[int(np.searchsorted(limits, wanted))]
