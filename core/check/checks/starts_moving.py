"""A recording whose arm moves before it begins."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from core.check.case import Case
from core.check.finding import Check, Finding

SHARE = 0.5
"""Of the rms speed: below, a model at rest is right within its noise."""
FIRST = 8
"""Samples through which a parabola goes: its slope at the first one is the speed there, and what
the drive does from then on is its curvature."""
SURE = 5.0
"""Standard deviations of that slope."""


class StartsMoving(Check):
    """The encoders' speed in the first samples."""

    kind = "starts_moving"

    def look(self, case: Case) -> Iterable[Finding]:
        found = case.recording
        for name in found.names("theta#"):
            q = found.even(name)
            if len(q) < 5 * FIRST:
                continue
            t = found.step * np.arange(FIRST)
            parts, *_ = np.linalg.lstsq(np.vander(t, 3), q[:FIRST], rcond=None)
            speed = float(parts[1])
            rest = q[:FIRST] - np.vander(t, 3) @ parts
            spread = np.linalg.inv(np.vander(t, 3).T @ np.vander(t, 3))[1, 1]
            error = float(np.sqrt(spread * np.sum(rest**2) / (FIRST - 3)))
            blocks = q[: len(q) // FIRST * FIRST].reshape(-1, FIRST)
            slopes = (blocks - blocks.mean(axis=1, keepdims=True)) @ (t - t.mean())
            slopes = slopes / np.sum((t - t.mean()) ** 2)
            usual = float(np.sqrt(np.mean(slopes**2)))
            if usual > 0 and abs(speed) > max(SHARE * usual, SURE * error):
                said = f"{name} moves at {speed:.4g}/s when the recording begins"
                yield case.finding(self.kind, name, speed, "SI/s", said)
