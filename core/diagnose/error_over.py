"""The error against the motion: does it follow a joint's speed, place, acceleration or bending?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from core.results import ErrorOver, JointMotion, RecordingComparison

BINS = 16

FEWEST = 20
"""Samples in a cell; the mean of fewer is noise."""

TAILS = 0.5
"""Per cent on each side that share the outermost bins: a few fast samples stretch no axis."""

QUANTITIES = {
    "position": lambda unit: unit,
    "velocity": lambda unit: f"{unit}/s",
    "acceleration": lambda unit: f"{unit}/s²",
    "deflection": lambda unit: "m",
}
"""What of a joint's motion an error may follow -> its unit, from that of the joint."""


@dataclass(frozen=True)
class _Samples:
    """One channel's counted errors (N,) over all recordings, and how the arm moved then."""

    unit: str
    error: np.ndarray
    motion: JointMotion


def errors_over(
    comparisons: Sequence[RecordingComparison], floors: Mapping[str, float]
) -> tuple[ErrorOver, ...]:
    """Each channel against each quantity of each joint; the clearest pattern first."""
    found = []
    for channel, floor in floors.items():
        samples = _gathered(comparisons, channel)
        if samples is None:
            continue
        for quantity in QUANTITIES:
            for k in range(len(samples.motion.units)):
                one = _over(channel, samples, quantity, k, floor)
                if one is not None:
                    found.append(one)
    return tuple(sorted(found, key=lambda one: -one.explained))


def _gathered(comparisons: Sequence[RecordingComparison], channel: str) -> _Samples | None:
    parts = [
        (c, r.motion)
        for r in comparisons
        for c in r.channels
        if c.channel == channel and r.motion is not None
    ]
    if not parts:
        return None
    counts = [c.counted & np.isfinite(c.residual) for c, _ in parts]

    def joined(name: str) -> np.ndarray:
        rows = [getattr(m, name)[keep] for (_, m), keep in zip(parts, counts, strict=True)]
        return np.concatenate(rows)

    error = np.concatenate([c.residual[keep] for (c, _), keep in zip(parts, counts, strict=True)])
    motion = JointMotion(
        joined("position"), joined("velocity"), joined("acceleration"), joined("deflection"),
        parts[0][1].units,
    )  # fmt: skip
    return _Samples(parts[0][0].unit, error, motion)


def _over(channel: str, samples: _Samples, quantity: str, k: int, floor: float) -> ErrorOver | None:
    x = getattr(samples.motion, quantity)[:, k]
    known = np.isfinite(x)
    x, error = x[known], samples.error[known]
    if x.size < 2 * FEWEST or np.ptp(x) == 0.0:
        return None
    low, high = np.percentile(x, [TAILS, 100.0 - TAILS])
    edges = np.linspace(low, high, BINS + 1) if high > low else np.linspace(x.min(), x.max(), 2)
    backwards = samples.motion.velocity[known, k] < 0.0
    bins = len(edges) - 1
    place = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, bins - 1) + bins * backwards
    count = np.bincount(place, minlength=2 * bins)
    mean = np.bincount(place, error, minlength=2 * bins) / np.maximum(count, 1)
    square = np.bincount(place, error**2, minlength=2 * bins) / np.maximum(count, 1)
    few = count < FEWEST
    return ErrorOver(
        channel=channel,
        unit=samples.unit,
        quantity=quantity,
        joint=k + 1,
        quantity_unit=QUANTITIES[quantity](samples.motion.units[k]),
        edges=edges,
        mean=np.where(few, np.nan, mean).reshape(2, bins),
        rms=np.where(few, np.nan, np.sqrt(square)).reshape(2, bins),
        count=count.reshape(2, bins),
        floor=floor,
        explained=_explained(error, place % bins, bins),
    )


def _explained(error: np.ndarray, place: np.ndarray, bins: int) -> float:
    """The correlation ratio: variance between the bins over all variance.

    Both directions together: what depends on the direction alone would otherwise be a pattern
    over every quantity, while over the velocity it is one anyway.
    """
    centred = error - error.mean()
    whole = float(np.sum(centred**2))
    count = np.bincount(place, minlength=bins)
    total = np.bincount(place, centred, minlength=bins)
    between = float(np.sum(total**2 / np.maximum(count, 1)))
    return between / whole if whole > 0.0 else 0.0
