"""A recording whose arm moves before it begins."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from core.check.band import noise_of
from core.check.case import Case
from core.check.finding import Check, Finding

SHARE = 0.5
"""Of the rms speed: below, a model at rest is right within its noise."""
FIRST = 5
"""Samples over which the measured slope is compared with that of a start at rest."""
SURE = 5.0
"""Standard deviations of that slope."""


class StartsMoving(Check):
    """The encoders' speed in the first samples, beyond what the references ask for there."""

    kind = "starts_moving"

    def look(self, case: Case) -> Iterable[Finding]:
        found = case.mended
        for name in found.names("theta#"):
            q = found.even(name)
            if len(q) < 10 * FIRST:
                continue
            usual = float(np.sqrt(np.mean(np.gradient(_averaged(q), found.step * FIRST) ** 2)))
            noise = noise_of(q) / (found.step * FIRST)
            beyond = _slope(q, found.step) - _slope(_from_rest(case, name), found.step)
            if usual > 0 and abs(beyond) > max(SHARE * usual, SURE * noise):
                speed = float(-3.0 * q[0] + 4.0 * q[1] - q[2]) / (2.0 * found.step)
                said = f"{name} moves at {speed:.4g}/s when the recording begins"
                yield case.finding(self.kind, name, speed, "SI/s", said)


def _averaged(q: np.ndarray) -> np.ndarray:
    return np.asarray(q[: len(q) // FIRST * FIRST].reshape(-1, FIRST).mean(axis=1))


def _slope(q: np.ndarray | None, step: float) -> float:
    return 0.0 if q is None else float(np.polyfit(step * np.arange(FIRST), q[:FIRST], 1)[0])


def _from_rest(case: Case, name: str) -> np.ndarray | None:
    """What the loop makes of the references from a start at rest; None where that is not known."""
    loops = [
        r for r in case.relations
        if r.output == name and r.inputs != (f"{name}_ref",) and len(r.inputs) > 1
    ]  # fmt: skip
    return loops[0].expected if loops else None
