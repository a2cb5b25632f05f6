"""The camera against the encoders through the arm's geometry: how far the tip is off."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy

from ..check.measured_recording import MeasuredRecording
from ..recording.channels import Role, role_of

POINTS = 200
"""Rows that are compared: the geometry has a handful of unknowns."""
BENDING = 0.02
"""Of the arm's reach: links of laboratory arms bend less than 2 % (the paper's: 0.4 %), so a
larger misfit is none of bending."""


@dataclass(frozen=True)
class TipGeometry:
    """Where the camera sees the tip, and where the encoders put it."""

    values: dict[str, np.ndarray]
    lengths: tuple[float, ...]

    @classmethod
    def of(cls, found: MeasuredRecording) -> TipGeometry | None:
        """None where there are no camera, encoders or revolute arm to compare."""
        model = found.model
        if model is None or any(
            s.joint != "revolute" or s.mount != "previous" for s in model.arm.segments
        ):
            return None
        names = [f"theta{k + 1}" for k in range(model.arm.joints)] + ["z1", "z2"]
        if not found.has(*names):
            return None
        chosen = np.flatnonzero(np.all([np.isfinite(found.counted(n)) for n in names], axis=0))
        if len(chosen) < 10:
            return None
        chosen = chosen[:: max(len(chosen) // POINTS, 1)]
        values = {n: found.counted(n)[chosen] for n in names}
        return cls(values, tuple(s.length for s in model.arm.segments))

    @property
    def reach(self) -> float:
        """m"""
        return sum(self.lengths)

    @property
    def tolerance(self) -> float:
        """m, of bending."""
        return BENDING * self.reach

    def misfit(self, name: str = "", factor: float = 1.0, shift: float = 0.0) -> float:
        """m, with one channel changed; robust: a few outliers are another fault."""
        values = self.values
        if name:
            values = {**values, name: (values[name] - shift) / factor}
        angle = np.zeros(len(values["z1"]))
        x, y = np.zeros_like(angle), np.zeros_like(angle)
        for k, length in enumerate(self.lengths):
            angle = angle + values[f"theta{k + 1}"]
            x, y = x + length * np.cos(angle), y + length * np.sin(angle)
        return float(1.4 * np.median(np.hypot(values["z1"] - x, values["z2"] - y)))

    def factors(self) -> list[tuple[str, float]]:
        """(channel, any factor from 0.2 to 5) with which the two agree."""
        grid = np.geomspace(0.2, 5.0, 41)
        tried = [(n, *_least(partial(self.misfit, n), grid)) for n in self.values]
        return [(name, size) for name, size, left in tried if left <= self.tolerance]

    def shifts(self) -> list[tuple[str, float]]:
        """(channel, shift in SI) with which the two agree."""
        made = []
        for name in self.values:
            most = self.reach if role_of(name) is Role.TIP else np.pi
            grid = np.linspace(-most, most, 61)
            size, left = _least(partial(self.misfit, name, 1.0), grid)
            made += [(name, size)] if left <= self.tolerance else []
        return made


def _least(cost: Callable[[float], float], grid: np.ndarray) -> tuple[float, float]:
    """(where, how small) a cost is least, on a grid and then refined."""
    k = int(np.argmin([cost(x) for x in grid]))
    low, high = grid[max(k - 1, 0)], grid[min(k + 1, len(grid) - 1)]
    found = scipy.optimize.minimize_scalar(cost, bounds=(low, high), method="bounded")
    return float(found.x), float(found.fun)
