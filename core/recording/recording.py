"""A recording: one experiment, one table, in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cache

import numpy as np
import scipy

from ..errors import InputError
from ..recording.channels import Role, is_reference, role_of


@dataclass(frozen=True)
class LoggerFilter:
    """The rig's low-pass w^2 / (s^2 + 2 zeta w s + w^2) of a channel; the model's output passes it
    too."""

    frequency: float
    """rad/s"""
    damping: float


@dataclass(frozen=True)
class CameraPose:
    """Where the camera of one experiment stood: z = origin + R(angle) scale z_camera."""

    origin: tuple[float, float] = (0.0, 0.0)
    """m"""
    angle: float = 0.0
    """rad"""
    scale: float = 1.0
    delay: float = 0.0
    """s, by which the camera's samples are late."""


class Beginning(StrEnum):
    """What is known of the arm's motion when a recording begins."""

    REST = "rest"
    MOTION = "motion"
    """Its joints move."""
    UNKNOWN = "unknown"
    """Its joints seem to rest; nothing shows whether its links do."""
    EQUILIBRIUM = "equilibrium"
    """It rests, and its links hang as their weight bends them."""


@dataclass(frozen=True)
class Recording:
    """Uniformly sampled channels (N,) in SI units.

    Every channel is float64; NaN means 'no sample' and is allowed only in sensors that may be
    slower than the logger (camera, strain), never in time, references, torques or encoders.
    """

    name: str
    """By which scenarios and results call it."""
    time: np.ndarray
    """(N,) s, evenly spaced"""
    channels: Mapping[str, np.ndarray]
    """Name -> (N,), SI: `theta1` in rad, `z1` in m, `u1` in N m, ..."""
    role: str = "estimate"
    """'estimate', or 'validate': no fit sees it."""
    counted: Mapping[str, np.ndarray] = field(default_factory=dict)
    """(N,) bool per channel: False where the user masked it. Channels not listed count whole."""
    logger_filters: Mapping[str, LoggerFilter] = field(default_factory=dict)
    """Channel -> the low-pass that it has passed in the rig."""
    unknown_gains: tuple[str, ...] = ()
    """Channels in a unit that nobody knows: counts, or the current of an unknown motor."""
    camera: CameraPose = CameraPose()
    """Where the camera stood."""
    source: str = ""
    """The file that it was read from."""
    warnings: tuple[str, ...] = ()
    """What was noticed when it was read, a sentence each."""
    theta2: float | None = None
    """The working point in rad where the experiment was made at one."""
    beginning: Beginning = Beginning.REST
    """What is known of the arm's motion at the first sample."""

    @property
    def sample_time(self) -> float:
        """s"""
        return float(self.time[-1] - self.time[0]) / (len(self.time) - 1)

    def has(self, *channels: str) -> bool:
        """Whether all of these channels are there."""
        return all(name in self.channels for name in channels)

    def __getitem__(self, channel: str) -> np.ndarray:
        if channel not in self.channels:
            raise InputError(
                f"Recording {self.name} ({self.source}) has no column {channel}; "
                f"add it to the file or map it under [recordings.columns]."
            )
        return self.channels[channel]

    def mask(self, channel: str) -> np.ndarray:
        """(N,) bool: the samples of a channel that count."""
        sampled = np.isfinite(self[channel])
        chosen = self.counted.get(channel)
        return sampled if chosen is None else sampled & chosen

    def excerpt(self, most: int) -> Recording:
        """At most `most` samples in a row, where the joints (or else the references) move most."""
        N = len(self.time)
        if most >= N:
            return self
        names = [n for n in self.channels if role_of(n) is Role.PLACE and not is_reference(n)]
        names = names or list(self.channels)
        first = range(0, N - most + 1, max(most // 2, 1))
        moved = [sum(np.ptp(self.channels[n][a : a + most]) for n in names) for a in first]
        a = first[int(np.nanargmax(moved))] if np.isfinite(moved).any() else 0
        return self.rows(slice(a, a + most))

    def rows(self, part: slice) -> Recording:
        """Some of its samples."""
        return replace(
            self,
            time=self.time[part],
            channels={name: x[part] for name, x in self.channels.items()},
            counted={name: x[part] for name, x in self.counted.items()},
        )


def apply_logger_filter(x: np.ndarray, dt: float, logger_filter: LoggerFilter) -> np.ndarray:
    """x (N, ...) along its first axis, every `dt` s, through w^2 / (s^2 + 2 zeta w s + w^2),
    settled at the first sample; exact for input that is linear in between. ValueError for empty
    samples."""
    x = np.asarray(x, dtype=float)
    if not np.isfinite(x).all():
        raise ValueError("a logger's filter runs on complete signals; the signal has empty samples")
    # x - x[0] starts at zero, where the ramp-invariant recursion at rest has no transient.
    b, a = _recursion(logger_filter, dt)
    return np.asarray(x[0] + scipy.signal.lfilter(b, a, x - x[0], axis=0))


@cache
def _recursion(logger_filter: LoggerFilter, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """b and a of the discretised filter; made once, as making them takes longer than the filter."""
    w, zeta = logger_filter.frequency, logger_filter.damping
    b, a, _ = scipy.signal.cont2discrete(([w * w], [1.0, 2.0 * zeta * w, w * w]), dt, method="foh")
    return np.ravel(b), a
