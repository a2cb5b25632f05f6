"""How large the error is at a moment, part by part of the arm."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from core.results import ChannelComparison, RecordingComparison
from flexgui.views.names import channel_symbol
from flexgui.views.numbers import format_number

WINDOW = 0.08
"""s over which the error is averaged: a single sample is noise."""

CAMERA = "camera"
TIP = (("z1", "z2"), ("y1", "y2"), ("ydot1", "ydot2"))
"""What a camera gives, the plainest first."""


@dataclass(frozen=True)
class ErrorNow:
    """The error of one recording along its time, in times the floor."""

    time: np.ndarray
    """(N,) s since the start"""
    parts: Mapping[str, np.ndarray]
    """channel of an encoder or a gauge, or 'camera' -> (N,)"""
    units: Mapping[str, str] = field(default_factory=dict)
    """channel -> its unit"""

    def at(self, time: float) -> dict[str, float]:
        """part -> times the floor."""
        k = int(np.clip(np.searchsorted(self.time, time), 0, len(self.time) - 1))
        return {name: float(values[k]) for name, values in self.parts.items()}

    @property
    def worst(self) -> float:
        """The largest error in noise floors; 1 where there is none."""
        return max(
            (float(v.max()) for values in self.parts.values() if len(v := values)), default=1.0
        )


def error_now(seen: RecordingComparison, floors: Mapping[str, float]) -> ErrorNow | None:
    """None where no measured part has a floor."""
    known = {c.channel: c for c in seen.channels if c.channel in floors}
    if not known:
        return None
    time = next(iter(known.values())).time
    parts = {
        name: np.sqrt(_square(c, floors[name]))
        for name, c in known.items()
        if name.startswith(("theta", "deflection"))
    }
    seen_by = next((names for names in TIP if known.keys() & set(names)), ())
    tip = [_square(known[name], floors[name]) for name in seen_by if name in known]
    if tip:
        parts[CAMERA] = np.sqrt(np.mean(tip, axis=0))
    units = {name: c.unit for name, c in known.items()}
    return ErrorNow(time - time[0], parts, units) if parts else None


def _square(c: ChannelComparison, floor: float) -> np.ndarray:
    """(N,) mean square in floors around each sample; zero where none counts."""
    counts = c.counted & np.isfinite(c.residual)
    square = np.where(counts, (np.nan_to_num(c.residual) / floor) ** 2, 0.0)
    dt = float(c.time[1] - c.time[0]) if len(c.time) > 1 else 1.0
    half = max(int(0.5 * WINDOW / dt), 1)
    total, many = (np.concatenate([[0.0], np.cumsum(x)]) for x in (square, counts))
    ends = np.arange(len(square))
    low, high = np.maximum(ends - half, 0), np.minimum(ends + half + 1, len(square))
    return np.asarray((total[high] - total[low]) / np.maximum(many[high] - many[low], 1.0))


def words(now: Mapping[str, float], units: Mapping[str, str] | None = None) -> str:
    """'error now: θ₁ 1.1, camera 35 × floor'; `units`: channel -> the unit of what it measures."""
    known = units or {}
    texts = [
        f"{name if name == CAMERA else channel_symbol(name, known.get(name, ''))} "
        f"{format_number(value, 2, keep_zeros=True)}"
        for name, value in now.items()
    ]
    return f"error now: {', '.join(texts)} × noise floor" if texts else ""
