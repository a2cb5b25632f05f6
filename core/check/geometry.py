"""The camera against the encoders through the arm's geometry: what one factor explains."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import scipy

from core.check.measured import Measured

POINTS = 200
"""Rows that are compared: the geometry has a handful of unknowns."""
BENDING = 0.02
"""Of the arm's reach: links of laboratory arms bend less than 2 % (the paper's: 0.4 %), so a
larger misfit is none of bending."""
BETTER = 3.0
"""Times smaller must a cause make the misfit."""
LARGEST = 300
"""Factor: gears of joints stay below it."""
DEGREES, MILLI = 180.0 / np.pi, 1000.0


@dataclass(frozen=True)
class Misfit:
    """A channel (or several) that is `factor` times what the geometry asks for, or swapped."""

    channels: tuple[str, ...]
    factor: float
    shift: float
    """SI, by which the channel is too large."""
    swapped: bool
    before: float
    """m rms"""
    after: float


def geometric_misfits(found: Measured) -> tuple[Misfit, ...]:
    """The causes, one for each way to be wrong, that explain a camera which does not see what the
    encoders say; the plain ones first. Empty where the two agree, or where there is no camera."""
    data = _Data.of(found)
    if data is None or data.misfit(data.values) <= data.tolerance:
        return ()
    before = data.misfit(data.values)
    made = [(left, cause) for left, cause in _causes(data) if left <= data.tolerance]
    best: dict[tuple[object, ...], tuple[float, _Cause]] = {}
    for left, cause in sorted(made, key=lambda one: one[0]):
        if left * BETTER < before:
            best.setdefault(
                (cause.channels, cause.rank, cause.swapped, cause.shift != 0), (left, cause)
            )
    ordered = sorted(best.values(), key=lambda one: one[1].rank)
    return tuple(
        Misfit(c.channels, c.factor, c.shift, c.swapped, before, left) for left, c in ordered
    )


def agrees(found: Measured) -> bool:
    """Whether the camera sees what the encoders say, but for bending."""
    data = _Data.of(found)
    return data is None or data.misfit(data.values) <= data.tolerance


def mended(found: Measured, one: Misfit) -> Measured:
    """The recording without the misfit."""
    return replace(found, channels=_without(found.channels, one))


@dataclass(frozen=True)
class _Cause:
    channels: tuple[str, ...]
    factor: float = 1.0
    shift: float = 0.0
    swapped: bool = False
    rank: int = 0


@dataclass(frozen=True)
class _Data:
    values: dict[str, np.ndarray]
    lengths: tuple[float, ...]

    @classmethod
    def of(cls, found: Measured) -> _Data | None:
        """None where there are no camera, encoders or revolute arm to compare."""
        model = found.model
        if model is None or any(
            s.joint != "revolute" or s.mount != "previous" for s in model.arm.segments
        ):
            return None
        names = [f"theta{k + 1}" for k in range(model.arm.joints)] + ["z1", "z2"]
        if not found.has(*names):
            return None
        rows = np.all([np.isfinite(found.counted(n)) for n in names], axis=0)
        chosen = np.flatnonzero(rows)
        if len(chosen) < 10:
            return None
        chosen = chosen[:: max(len(chosen) // POINTS, 1)]
        values = {n: found.counted(n)[chosen] for n in names}
        return cls(values, tuple(s.length for s in model.arm.segments))

    @property
    def tolerance(self) -> float:
        """m, of bending."""
        return BENDING * sum(self.lengths)

    def misfit(self, values: dict[str, np.ndarray]) -> float:
        """m, robust: a few outliers are another fault."""
        angle = np.zeros(len(values["z1"]))
        x, y = np.zeros_like(angle), np.zeros_like(angle)
        for k, length in enumerate(self.lengths):
            angle = angle + values[f"theta{k + 1}"]
            x, y = x + length * np.cos(angle), y + length * np.sin(angle)
        return float(1.4 * np.median(np.hypot(values["z1"] - x, values["z2"] - y)))


def _causes(data: _Data) -> list[tuple[float, _Cause]]:
    joints = [name for name in data.values if name.startswith("theta")]
    tried: list[_Cause] = []
    for group in (*((n,) for n in data.values), tuple(joints), ("z1", "z2")):
        unit = MILLI if group[0].startswith("z") else DEGREES
        tried += [_Cause(group, unit, rank=1), _Cause(group, 1 / unit, rank=3)]
        if len(group) == 1:
            tried += [_Cause(group, -1.0, rank=1)]
    for name in joints:
        tried += [_Cause((name,), float(n), rank=2) for n in range(2, LARGEST)]
    tried += [_Cause(pair, swapped=True, rank=1) for pair in combinations(joints, 2)]
    tried += [_Cause(("z1", "z2"), swapped=True, rank=1)]
    plain = [(_left(data, cause), cause) for cause in tried]
    for name in data.values:
        plain += [_scaled(data, name), _shifted(data, name)]
    return plain


def _left(data: _Data, cause: _Cause) -> float:
    return data.misfit(_without(data.values, cause))


def _without(values: Mapping[str, np.ndarray], one: Misfit | _Cause) -> dict[str, np.ndarray]:
    """Channel -> values (N,), what is wrong with them taken back."""
    found = dict(values)
    if one.swapped:
        a, b = one.channels
        found[a], found[b] = found[b], found[a]
    else:
        for name in one.channels:
            found[name] = (found[name] - one.shift) / one.factor
    return found


def _scaled(data: _Data, name: str) -> tuple[float, _Cause]:
    """Any factor from 0.2 to 5, on a grid and then refined."""
    grid = np.geomspace(0.2, 5.0, 41)
    left = [_left(data, _Cause((name,), f)) for f in grid]
    k = int(np.argmin(left))
    low, high = grid[max(k - 1, 0)], grid[min(k + 1, len(grid) - 1)]
    found = scipy.optimize.minimize_scalar(
        lambda f: _left(data, _Cause((name,), f)), bounds=(low, high), method="bounded"
    )
    return float(found.fun), _Cause((name,), float(found.x), rank=4)


def _shifted(data: _Data, name: str) -> tuple[float, _Cause]:
    reach = sum(data.lengths) if name.startswith("z") else np.pi
    grid = np.linspace(-reach, reach, 61)
    left = [_left(data, _Cause((name,), shift=s)) for s in grid]
    k = int(np.argmin(left))
    step = grid[1] - grid[0]
    found = scipy.optimize.minimize_scalar(
        lambda s: _left(data, _Cause((name,), shift=s)),
        bounds=(grid[k] - step, grid[k] + step), method="bounded",
    )  # fmt: skip
    return float(found.fun), _Cause((name,), shift=float(found.x), rank=4)
