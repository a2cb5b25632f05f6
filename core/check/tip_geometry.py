"""Tip position by camera and by encoders: how far they disagree."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy

from ..check.measured_recording import MeasuredRecording
from ..recording.channels import Role, role_of

POINTS = 200
"""Rows that are compared: the geometry has few unknowns."""
BENDING = 0.02
"""Share of the arm's reach: links of laboratory arms bend less than 2 % (the paper's: 0.4 %)."""


@dataclass(frozen=True)
class TipGeometry:
    """Tip position by camera and by encoders."""

    values: dict[str, np.ndarray]
    lengths: tuple[float, ...]

    @classmethod
    def of(cls, recording: MeasuredRecording) -> TipGeometry | None:
        """None without camera, encoders or a revolute arm."""
        model = recording.model
        if model is None or any(
            s.joint != "revolute" or s.mount != "previous" for s in model.arm.segments
        ):
            return None
        names = [f"theta{k + 1}" for k in range(model.arm.joints)] + ["z1", "z2"]
        if not recording.has(*names):
            return None
        chosen = np.flatnonzero(np.all([np.isfinite(recording.counted(n)) for n in names], axis=0))
        if len(chosen) < 10:
            return None
        chosen = chosen[:: max(len(chosen) // POINTS, 1)]
        values = {n: recording.counted(n)[chosen] for n in names}
        return cls(values, tuple(s.length for s in model.arm.segments))

    @property
    def reach(self) -> float:
        """m"""
        return sum(self.lengths)

    @property
    def tolerance(self) -> float:
        """m, tolerance for bending."""
        return BENDING * self.reach

    def misfit(self, name: str = "", factor: float = 1.0, shift: float = 0.0) -> float:
        """m: median disagreement, with one channel changed; robust against outliers."""
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
        """(channel, factor from 0.2 to 300) with which both agree."""
        grid = np.geomspace(0.2, 300.0, 92)
        tried = [(n, *_least(partial(self.misfit, n), grid)) for n in self.values]
        return [(name, size) for name, size, misfit in tried if misfit <= self.tolerance]

    def shifts(self) -> list[tuple[str, float]]:
        """(channel, shift in SI) with which both agree."""
        shifts = []
        for name in self.values:
            most = self.reach if role_of(name) is Role.TIP else np.pi
            grid = np.linspace(-most, most, 61)
            size, misfit = _least(partial(self.misfit, name, 1.0), grid)
            shifts += [(name, size)] if misfit <= self.tolerance else []
        return shifts


def _least(cost: Callable[[float], float], grid: np.ndarray) -> tuple[float, float]:
    """(argument, value) of the least cost, on a grid and then refined."""
    k = int(np.argmin([cost(x) for x in grid]))
    low, high = grid[max(k - 1, 0)], grid[min(k + 1, len(grid) - 1)]
    result = scipy.optimize.minimize_scalar(cost, bounds=(low, high), method="bounded")
    return float(result.x), float(result.fun)
