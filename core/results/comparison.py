"""Measured against model, and where the model fails."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..results.identification import Estimate

DIAGNOSIS_FIT = "the diagnosis, starts free"
"""Label of its fit; an identification holds the starts on the encoders' first samples."""


@dataclass(frozen=True)
class ChannelComparison:
    """Measured against model for one output of one recording; NaN is 'no sample'."""

    channel: str
    """Such as 'z1' (tip), 'theta1' (joint) or 'deflection1'."""
    unit: str
    """SI, of all its values: m, rad, N m, ..."""
    time: np.ndarray
    """(N,) s"""
    measured: np.ndarray
    """(N,) in `unit`"""
    model: np.ndarray
    """(N,) in `unit`"""
    counted: np.ndarray
    """(N,) bool: samples that count (sampled and not masked)."""
    fitted: bool = True
    """Whether this output is one the fit minimised; others are shown for information."""

    @property
    def residual(self) -> np.ndarray:
        """(N,) measured minus modelled, in the channel's unit."""
        return self.measured - self.model

    @property
    def rms(self) -> float:
        """Root mean square of the residual where it counts, in `unit`; NaN where nothing does."""
        r = self.residual[self.counted]
        return float(np.sqrt(np.mean(r * r))) if r.size else float("nan")

    @property
    def fit_percent(self) -> float:
        """FIT = 100 max(1 - |y - yhat| / |y - mean y|, 0), in per cent."""
        return 100.0 * float(np.maximum(1.0 - self.normalised_error, 0.0))  # NaN stays NaN

    @property
    def normalised_error(self) -> float:
        """|y - yhat| / |y - mean y|, no unit."""
        y = self.measured[self.counted]
        spread = float(np.linalg.norm(y - y.mean())) if y.size else 0.0
        if spread == 0.0:
            return float("nan")
        return float(np.linalg.norm(self.residual[self.counted])) / spread

    @property
    def relative_error(self) -> float:
        """|y - yhat| / |y|, no unit (the usual figure for torques and forces)."""
        y = self.measured[self.counted]
        size = float(np.linalg.norm(y))
        return float(np.linalg.norm(self.residual[self.counted])) / size if size else float("nan")


@dataclass(frozen=True)
class MissingTorque:
    """The joint torque (or force) that the model lacks along the measured motion."""

    joint: int
    unit: str
    time: np.ndarray
    velocity: np.ndarray
    """Joint velocity, rad/s or m/s."""
    velocity_unit: str
    missing: np.ndarray
    """Applied minus what the model needs for the motion, in `unit`."""
    applied: np.ndarray
    """By the drive: as recorded, else by its law along the motion."""
    counted: np.ndarray


@dataclass(frozen=True)
class JointMotion:
    """How the model moved at the times of the outputs: what an error may depend on.

    All (M, joints); the units are those of the joint, rad or m, and per s and s².
    """

    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    deflection: np.ndarray
    """m: of each segment's end beside its root's direction; zero for rigid segments."""
    units: tuple[str, ...]


@dataclass(frozen=True)
class InputSignal:
    """What moved the arm: a reference of its drive or, where the motion is prescribed, a joint's
    speed."""

    channel: str
    unit: str
    values: np.ndarray
    """(N,) in `unit`, at the times of the outputs"""


@dataclass(frozen=True)
class RecordingComparison:
    """All outputs of one recording, with the fit that the model's values come from."""

    recording: str
    """Its name."""
    role: str
    """'estimate', or 'validate' where no fit has seen it."""
    fit_label: str
    """Of the fit: of all recordings (glocal) or of one (local)."""
    channels: tuple[ChannelComparison, ...]
    """One per output."""
    missing_torque: tuple[MissingTorque, ...] = ()
    """One per joint, where the drive's torque is known."""
    note: str = ""
    """How exactly the model was simulated, a sentence; empty: not estimated."""
    tip_rms: float | None = None
    """Root mean square distance between measured and modelled tip in m; None without a camera."""
    theta2: float | None = None
    """rad, the working point; None where the recording is not made at one."""
    motion: JointMotion | None = None
    """How the model moved, where that was kept."""
    inputs: tuple[InputSignal, ...] = ()
    """What moved the arm."""


@dataclass(frozen=True)
class Variant:
    """Another model on the same data (a row of the comparison table)."""

    title: str
    estimates: tuple[Estimate, ...]
    comparisons: tuple[RecordingComparison, ...]


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

    def cell(self, row: int, column: int) -> WorstCell:
        """One cell of the map."""
        low, high = self.edges[column : column + 2]
        rms, ratio = float(self.rms[row, column]), float(self.ratio[row, column])
        return WorstCell(
            self.recordings[row], self.channel, self.unit, self.axis, self.axis_unit, float(low),
            float(high), rms, ratio,
        )  # fmt: skip


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
