"""Frozen records of what an identification found; written as JSON and CSV, never pickled."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Estimate:
    """One estimated parameter; `std` holds under coloured residuals."""

    name: str
    value: float
    std: float
    unit: str
    identifiable: bool
    symbol: str = ""
    start: float = np.nan
    lower: float = -np.inf
    upper: float = np.inf
    recording: str | None = None
    """The recording that the parameter belongs to; None where it is shared by all."""
    at_bound: bool = False


@dataclass(frozen=True)
class Valley:
    """Points along which the cost hardly changes, in the plane of two parameters."""

    names: tuple[str, str]
    units: tuple[str, str]
    points: np.ndarray
    """(k, 2), in `units`."""
    cost_ratio: np.ndarray
    """(k,), the cost there over the least cost."""
    invariant: str
    """What is constant along it, such as 'ε d⁴'."""


@dataclass(frozen=True)
class Identifiability:
    """What the data fix and what they leave free."""

    names: tuple[str, ...]
    rank: int
    singular_values: np.ndarray
    """(p,), of the sensitivities to relative changes, weighted by the noise."""
    null_directions: np.ndarray
    """(p - rank, p), relative changes that the outputs do not show."""
    sentences: tuple[str, ...]
    valley: Valley | None = None


@dataclass(frozen=True)
class Generation:
    """One generation of the evolution, as streamed and as kept for the convergence plot."""

    number: int
    best: float
    mean: float
    worst: float
    best_vector: np.ndarray
    population: np.ndarray | None = None
    """(members, p) where it was asked for."""


@dataclass(frozen=True)
class Fit:
    """One minimisation: over all recordings (glocal) or over one (local)."""

    label: str
    recordings: tuple[str, ...]
    estimates: tuple[Estimate, ...]
    correlation: np.ndarray
    """(p, p)"""
    cost: float
    residual_count: int
    convergence: tuple[Generation, ...]
    identifiability: Identifiability
    gradient_norm: float
    """Norm of the scaled gradient relative to the cost's own scale; small means converged."""
    message: str = ""
    stopped: bool = False
    derived: tuple[Estimate, ...] = ()
    """Quantities that follow from the estimates, such as EI from epsilon and d."""


@dataclass(frozen=True)
class ChannelComparison:
    """Measured against model for one output of one recording; NaN is 'no sample'."""

    channel: str
    unit: str
    time: np.ndarray
    measured: np.ndarray
    model: np.ndarray
    counted: np.ndarray
    """(N,) bool: samples that count (sampled and not masked)."""
    fitted: bool = True
    """Whether this output is one the fit minimised; others are shown for information."""

    @property
    def residual(self) -> np.ndarray:
        return self.measured - self.model

    @property
    def rms(self) -> float:
        r = self.residual[self.counted]
        return float(np.sqrt(np.mean(r * r))) if r.size else float("nan")

    @property
    def fit_percent(self) -> float:
        """FIT = 100 max(1 - |y - yhat| / |y - mean y|, 0), in per cent."""
        y = self.measured[self.counted]
        spread = float(np.linalg.norm(y - y.mean())) if y.size else 0.0
        if spread == 0.0:
            return float("nan")
        return 100.0 * max(1.0 - float(np.linalg.norm(self.residual[self.counted])) / spread, 0.0)

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
    """Recorded minus modelled, in `unit`."""
    recorded: np.ndarray
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
class RecordingComparison:
    """All outputs of one recording, with the fit that the model's values come from."""

    recording: str
    role: str
    fit_label: str
    channels: tuple[ChannelComparison, ...]
    missing_torque: tuple[MissingTorque, ...] = ()
    note: str = ""
    tip_rms: float | None = None
    """Root mean square distance between measured and modelled tip in m; None without a camera."""
    theta2: float | None = None
    """rad, the working point; None where the recording is not made at one."""
    motion: JointMotion | None = None


@dataclass(frozen=True)
class Variant:
    """Another model on the same data (a row of the comparison table)."""

    title: str
    estimates: tuple[Estimate, ...]
    comparisons: tuple[RecordingComparison, ...]


@dataclass(frozen=True)
class Equation:
    """A displayed equation of the model."""

    title: str
    latex: str
    note: str = ""


@dataclass(frozen=True)
class DescriptorModel:
    """E(kappa) x' = A x + B u, y = C x in affine terms, numbers at the estimate.

    `E_terms[i]` belongs to `basis[i]`, a readable function of the scheduling variables such as
    '1' or 'cos(theta2)'; the same for A.
    """

    basis: tuple[str, ...]
    E_terms: np.ndarray
    """(terms, nx, nx)"""
    A_basis: tuple[str, ...]
    A_terms: np.ndarray
    """(terms, nx, nx)"""
    B: np.ndarray
    """(nx, nu)"""
    outputs: tuple[str, ...]
    C: np.ndarray
    """(ny, nx)"""
    D: np.ndarray
    """(ny, nu)"""
    states: tuple[str, ...]
    inputs: tuple[str, ...]


@dataclass(frozen=True)
class ChannelError:
    """The error of one channel over all recordings of a role."""

    channel: str
    unit: str
    rms: float
    floor: float
    """Below which an error says nothing: noise and fidelity."""
    validation_rms: float = float("nan")


@dataclass(frozen=True)
class LadderStep:
    """One step of the error ladder: the model after an effect was added (None: as given)."""

    added: str | None
    title: str
    parameters: tuple[Estimate, ...]
    """Of the added effect; all unknowns for the first step."""
    errors: tuple[ChannelError, ...]
    tip_rms: float | None
    """m, over the estimation recordings; None without a camera."""
    cost_per_sample: float
    """Mean squared error in floors: 1 is the floor."""
    fit_percent: tuple[float, ...] = ()
    """FIT per channel over the estimation recordings, in the order of `errors`."""
    validation_fit_percent: tuple[float, ...] = ()


@dataclass(frozen=True)
class RankedEffect:
    """One candidate of a round."""

    effect: str
    title: str
    score: float
    """Whitened score, chi-squared where the effect is absent."""
    p_value: float
    """Corrected for all that was tried."""
    expected_drop_percent: float
    """Of the squared error above the floor, by the linear screen."""
    refit_drop_percent: float | None
    """The same by a full refit; None where none was made."""
    delta_bic: float | None
    confused_with: tuple[str, ...] = ()
    parameters: tuple[Estimate, ...] = ()
    predicted: tuple[np.ndarray, ...] = ()
    """(M, k) per recording in floors: the residual that the effect predicts."""


@dataclass(frozen=True)
class PlannedExperiment:
    """An experiment that was not made yet, and how well it would tell two effects apart."""

    title: str
    simulate: Mapping[str, object]
    """Its settings, as `simulate` of a scenario's recording."""
    score: float
    """Expected rise of the squared error, in floors, when the wrong effect is refitted; the
    smaller of the two ways round."""
    sentence: str


@dataclass(frozen=True)
class DiagnosisRound:
    """One round: the ranking on the model so far, and what was added."""

    ranking: tuple[RankedEffect, ...]
    accepted: str | None
    sentence: str = ""
    experiments: tuple[PlannedExperiment, ...] = ()
    """Where two effects could not be told apart: what to do next, best first."""


@dataclass(frozen=True)
class Diagnosis:
    """What is missing, how sure, and how the error fell."""

    verdict: str
    """missing, nothing_missing or unlisted: of the model as given"""
    final_verdict: str | None
    """The same of what remains after the ladder; None where nothing was to be added."""
    rounds: tuple[DiagnosisRound, ...]
    steps: tuple[LadderStep, ...]
    words: tuple[str, ...]
    """The verdict for a student, one paragraph each."""
    not_applicable: Mapping[str, str]
    """effect -> why this rig cannot show it"""
    effects: tuple[Mapping[str, object], ...] = ()
    """What was accepted, as [model] effects of a scenario."""
    floors: Mapping[str, float] = field(default_factory=dict)
    seconds: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    @property
    def ranking(self) -> tuple[RankedEffect, ...]:
        """That of the first round."""
        return self.rounds[0].ranking if self.rounds else ()


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


@dataclass(frozen=True)
class Outcome:
    """All that a scenario's run produced; the page and the report show nothing else."""

    title: str
    method: str
    level: str
    """'lpv' or 'nonlinear'"""
    fits: tuple[Fit, ...]
    comparisons: tuple[RecordingComparison, ...]
    model: DescriptorModel
    equations: tuple[Equation, ...]
    variants: tuple[Variant, ...] = ()
    seconds: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    """Sentences on how it was done: filter, output, simulation error, excitation, warnings."""
    arm_table: tuple[tuple[str, str, float, str], ...] = ()
    """(name, title, value, unit) of the arm's and the drive's parameters as given."""
    diagnosis: Diagnosis | None = None
