"""One recording as in the file, and on an even clock, for the checks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..check.signals import far_out
from ..model import Model
from ..recording.channels import channel_kind, is_reference
from ..recording.initial_motion import with_beginnings
from ..recording.recording import Beginning, CameraPose, LoggerFilter, Recording
from ..scenario.schema import IdentifySpec

FEWEST_SAMPLES = 50
"""Fewest samples for statistics of a channel."""


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
    logger_filters: Mapping[str, LoggerFilter] = field(default_factory=dict)
    """Channel -> the low-pass that it has passed in the rig."""
    unknown_gains: tuple[str, ...] = ()
    """Channels in a unit that nobody knows."""
    camera: CameraPose = CameraPose()
    """Its delay; its channels are in the base's frame."""
    model: Model | None = None
    """None where a file is checked without a scenario."""
    values: Mapping[str, float] = field(default_factory=dict)
    """Parameters as identified."""
    identify: IdentifySpec | None = None
    """How an identification compares it."""

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

    def sampled(self, channel: str) -> np.ndarray:
        """(M,) on the even clock, without outliers; of a sensor that may be slow NaN where it has
        no sample near."""
        values = self._evened(self._without_outliers(channel))
        sparse = channel_kind(channel).sparse
        return np.where(self.near(channel), values, np.nan) if sparse else values

    def near(self, channel: str) -> np.ndarray:
        """(M,) True where a sample that is no outlier is near on the even clock."""
        good = np.isfinite(self._without_outliers(channel)) & np.isfinite(self.time)
        near = np.zeros(len(self.grid), dtype=bool)
        rows = np.round((self.time[good] - self.grid[0]) / self.step).astype(int)
        near[rows[(rows >= 0) & (rows < len(near))]] = True
        return near

    def _without_outliers(self, channel: str) -> np.ndarray:
        values = self.counted(channel).copy()
        good = np.flatnonzero(np.isfinite(values))
        if len(good) >= FEWEST_SAMPLES and not is_reference(channel):
            values[good[far_out(values[good])]] = np.nan
        return values

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
        return len(self.grid) >= FEWEST_SAMPLES and all(
            name in self.channels and np.isfinite(self.counted(name)).sum() >= FEWEST_SAMPLES
            for name in names
        )

    @cached_property
    def begins_in_motion(self) -> bool:
        """Whether its joints move before what drives them does."""
        channels = {n: self.even(n) for n in self.channels if self.has(n)}
        held, references = True, tuple(self.names("dtheta#_ref", "theta#_ref"))
        if self.model is not None:
            references = self.model.drive.reference_channels(self.model.arm)
            law = self.model.drive.law(self.model.arm, self.model.numbers().p, {})
            held = self.model.drive.holds_joints(law)
        recording, joints = Recording(self.name, self.grid, channels), len(self.names("theta#"))
        (known,) = with_beginnings([recording], joints, references, held)
        return known.beginning is Beginning.MOTION

    def names(self, *patterns: str) -> list[str]:
        """Channels of the families with these patterns, such as `theta#`."""
        return [n for n in self.channels if channel_kind(n).pattern in patterns and self.has(n)]
