"""One recording as in the file, and on an even clock, for the checks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ..model import Model
from ..recording.channels import channel_kind, joint_of

FEWEST = 50
"""Fewest samples for statistics of a channel."""
ON_LATTICE = 0.1
"""Largest rms distance from whole steps, in steps."""
FEWEST_LEVELS = 3
"""Levels needed to find a step."""


@dataclass(frozen=True)
class MeasuredRecording:
    """One recording; arrays (N,) in SI, NaN where there is no sample."""

    name: str
    role: str
    time: np.ndarray
    """s, as in the file: it may repeat, decrease or jump."""
    channels: Mapping[str, np.ndarray]
    headers: Mapping[str, str] = field(default_factory=dict)
    """Channel -> column of the file; empty where the recording is simulated."""
    masks: Mapping[str, np.ndarray] = field(default_factory=dict)
    """Channel -> (N,) True where the scenario says that the samples count."""
    model: Model | None = None
    """None where a file is checked without a scenario."""
    values: Mapping[str, float] = field(default_factory=dict)
    """Parameters known better than the scenario states."""
    loop_responses: dict[object, tuple[Model, Mapping[str, np.ndarray] | None]] = field(
        default_factory=dict, repr=False
    )
    """Simulated responses of the scenario's loop, by model and inputs; shared by copies with other
    sensors."""

    @cached_property
    def step(self) -> float:
        """s, the usual distance of two rows."""
        steps = np.diff(self.time[np.isfinite(self.time)])
        rising = steps[steps > 0]
        return float(np.median(rising)) if rising.size else 1.0

    @cached_property
    def stated_step(self) -> float:
        """s, the median distance of two rows as it stands."""
        steps = np.diff(self.time[np.isfinite(self.time)])
        return float(np.median(steps)) if steps.size else 0.0

    @cached_property
    def rows(self) -> int:
        """N"""
        return len(self.time)

    @cached_property
    def grid(self) -> np.ndarray:
        """s (M,), an even clock from the first row to the last at the usual step."""
        good = self.time[np.isfinite(self.time)]
        count = min(int(round((good[-1] - good[0]) / self.step)) + 1, 4 * self.rows)
        return np.asarray(good[0] + self.step * np.arange(max(count, 2)))

    @cached_property
    def cache(self) -> dict[object, Any]:
        """Expensive results of this recording, by their kind."""
        return {}

    def counted(self, channel: str) -> np.ndarray:
        """(N,) values; NaN where masked, and where the last sample of a slow sensor is held."""
        held = self.held(channel)
        return np.where(self.masks.get(channel, True) & ~held, self.channels[channel], np.nan)

    def held(self, channel: str) -> np.ndarray:
        """(N,) True where a slow sensor's last sample stands until its next one. A sensor with
        coarse steps repeats values too, but it mostly changes by one step."""
        x = self.channels[channel]
        changes = np.abs(np.diff(x, prepend=np.nan))
        moves, strides = changes[changes > 0], np.diff(np.flatnonzero(changes > 0))
        slow = channel_kind(channel).sparse and len(strides) and np.median(strides) > 1.0
        return (changes == 0.0) & bool(slow and np.median(moves) > 1.5 * moves.min())

    def even(self, channel: str) -> np.ndarray:
        """(M,) on the even clock: gaps interpolated, repeated times removed."""
        cached = self._even.get(channel)
        if cached is None:
            cached = self._even[channel] = self._evened(self.counted(channel))
        return cached

    @cached_property
    def _even(self) -> dict[str, np.ndarray]:
        return {}

    def _evened(self, values: np.ndarray) -> np.ndarray:
        good = np.isfinite(values) & np.isfinite(self.time)
        if good.sum() < 2:
            return np.full(len(self.grid), np.nan)
        time, first = np.unique(self.time[good], return_index=True)
        return np.interp(self.grid, time, values[good][first])

    def has(self, *names: str) -> bool:
        """Whether all channels exist with enough samples."""
        return len(self.grid) >= FEWEST and all(
            name in self.channels and np.isfinite(self.counted(name)).sum() >= FEWEST
            for name in names
        )

    def names(self, *patterns: str) -> list[str]:
        """Channels of the families with these patterns, such as `theta#`."""
        return [n for n in self.channels if channel_kind(n).pattern in patterns and self.has(n)]

    def joint(self, channel: str) -> int:
        """Joint of a channel from 0; 0 if none."""
        return joint_of(channel) or 0


def noise_of(x: np.ndarray) -> float:
    """Standard deviation of white noise in a smooth signal (N,), by its third differences."""
    if len(x) < 10:
        return 0.0
    # The variance of the third difference of white noise is 20 times its own.
    return 1.4826 * float(np.median(np.abs(np.diff(x, 3)))) / np.sqrt(20.0)


def lattice_step(x: np.ndarray) -> float:
    """Quantisation step of values (N,) with many samples per level; 0: none."""
    levels = np.unique(x[np.isfinite(x)])
    if len(levels) < FEWEST_LEVELS or len(levels) > np.isfinite(x).sum() / 5:
        return 0.0
    gaps = np.diff(levels)
    step = float(np.median(gaps[gaps > 1e-9 * np.ptp(levels)]))
    whole = (levels - levels[0]) / step
    off = float(np.sqrt(np.mean((whole - np.round(whole)) ** 2)))
    return step if off < ON_LATTICE else 0.0


SHARE_AT_LIMIT = 0.01
"""Share of the samples; real recordings have 0.2 % at their largest value."""
FEWEST_AT_LIMIT = 8
"""Fewest samples at a limit."""
LONGEST = 20
"""Equal samples in a row: noise and motion never repeat a value so often."""
FAR = 8.0
"""Times what nearly all samples stand out by at most; white noise stays below four."""


def jumps(x: np.ndarray) -> list[tuple[int, float]]:
    """Samples from which on a position (N,) is shifted, and by how much: it moves there FAR beyond
    what it does around. It does not come back as an outlier does, nor does it leave a frozen
    stretch or a zero."""
    moves = np.diff(x)
    steps = np.abs(moves)
    if not steps.any():
        return []
    usual = max(np.percentile(steps, 99), np.median(steps[steps > 0]))
    found = []
    for k in np.flatnonzero(steps > FAR * usual):
        around = slice(max(k - 2, 0), k + 3)
        alone = np.sum(steps[around] > steps[k] / FAR) == 1
        if alone and steps[max(k - LONGEST, 0) : k].any() and x[k] * x[k + 1] != 0.0:
            found.append((int(k) + 1, float(moves[k] - np.median(moves[around]))))
    return found


NEAR_LIMIT = 0.02
"""Share of the range: a smooth turning point has more samples below its top than at it."""
FAST = 0.25
"""Share of the usual speed: a signal runs into a limit, an encoder at rest does not."""


def limit_of(values: np.ndarray) -> tuple[float, float] | None:
    """(the value at which a signal (N,) is cut off, share of its samples there), or None."""
    x = values[np.isfinite(values)]
    if len(x) < 5 * FEWEST_AT_LIMIT or np.ptp(x) == 0.0:
        return None
    limits = [each for each in (_at(x, x.max(), 1.0), _at(x, x.min(), -1.0)) if each is not None]
    return max(limits, key=lambda limit: limit[1]) if limits else None


def _at(x: np.ndarray, top: float, side: float) -> tuple[float, float] | None:
    at = x == top
    count = int(at.sum())
    levels = np.unique(x)
    step = float(np.median(np.diff(levels)))
    below = side * (top - x)
    near = int(np.sum((below > 0) & (below <= max(NEAR_LIMIT * float(np.ptp(x)), 3.0 * step))))
    if count < max(FEWEST_AT_LIMIT, SHARE_AT_LIMIT * len(x)) or count <= near:
        return None
    edges = np.flatnonzero(np.diff(at.astype(int)) != 0)
    if len(edges) == 0 or not np.any(at[1:] & at[:-1]):
        return None
    if lattice_step(x) > 0 and len(edges) <= 2:
        return None  # where dry friction holds a joint once, an encoder repeats a value as well
    speed = np.abs(np.diff(x))
    usual = float(np.sqrt(np.mean(speed**2)))
    # Two samples before the limit and two after it.
    speeds = [speed[np.clip([k - 1, k, k + 1], 0, len(speed) - 1)].max() for k in edges]
    return (float(top), count / len(x)) if np.median(speeds) > FAST * usual else None
