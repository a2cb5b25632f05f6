"""Where a model fails."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class ErrorMap:
    """How large the error of one channel is, by recording and along time or frequency."""

    channel: str
    unit: str
    axis: str
    """'time' or 'frequency'"""
    axis_unit: str
    """s since the recording's start, or Hz"""
    recordings: tuple[str, ...]
    theta2: tuple[float | None, ...]
    """rad, the working point of each recording where it has one."""
    edges: np.ndarray
    """(n + 1,) of the time windows or frequency bands."""
    rms: np.ndarray
    """(recordings, n) in `unit`; NaN where nothing was measured."""
    floor: np.ndarray
    """(recordings, n): the rms of an error that is at the floor."""

    @property
    def ratio(self) -> np.ndarray:
        """(recordings, n): times the floor."""
        return self.rms / self.floor


@dataclass(frozen=True)
class WorstCell:
    """One place where the model fails."""

    recording: str
    channel: str
    unit: str
    axis: str
    axis_unit: str
    low: float
    high: float
    rms: float
    ratio: float
    """Times the floor."""


@dataclass(frozen=True)
class ErrorOver:
    """The error of one channel against a quantity of the motion, split by direction."""

    channel: str
    unit: str
    quantity: str
    """'position', 'velocity', 'acceleration' or 'deflection'"""
    joint: int
    """Counted from 1; for a deflection the segment."""
    quantity_unit: str
    edges: np.ndarray
    """(n + 1,)"""
    mean: np.ndarray
    """(2, n): forwards, backwards (the sign of the joint's velocity); NaN where too few."""
    rms: np.ndarray
    """(2, n)"""
    count: np.ndarray
    """(2, n) samples"""
    floor: float
    explained: float
    """Share of the error's variance that lies between the bins of the quantity, both directions
    together: 0 no pattern, 1 nothing but pattern."""


@dataclass(frozen=True)
class ErrorMaps:
    """Where a model fails."""

    by_time: tuple[ErrorMap, ...]
    by_frequency: tuple[ErrorMap, ...]
    over: tuple[ErrorOver, ...]
    """Clearest pattern first."""
    worst: tuple[WorstCell, ...]
    """The ten worst cells of the maps, worst first."""
