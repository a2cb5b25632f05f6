"""All that a scenario's run produced, with the model as it is displayed and its repetitions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from core.results.comparison import RecordingComparison, Variant
from core.results.diagnosis import Diagnosis
from core.results.identification import Estimate, Fit
from core.results.mechanism import Mechanism


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
    origins: Mapping[str, str] = field(default_factory=dict)
    """Name of an estimate -> arm, drive, sensor, or the id of the effect it belongs to."""
    as_given: tuple[Estimate, ...] = ()
    """Estimates of the first fit, where `fits` are of a model that has grown since."""
    repeated: tuple[Repeated, ...] = ()
    """Parameters over the runs of one experiment, where each run has estimates of its own."""
    mechanism: Mechanism | None = None
    """The arm of `model` in plain numbers; None where nobody stated it."""


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
class Disagreement:
    """A run whose parameter is not what the other runs say."""

    run: str
    share: float
    """Of the others' mean by which it differs."""
    p_value: float


@dataclass(frozen=True)
class Repeated:
    """One parameter over the runs of an experiment."""

    name: str
    unit: str
    mean: float
    between: float
    """Standard deviation between runs, those left out that disagree; what a next run will do."""
    within: float
    """Root mean square of the runs' own deviations."""
    interval: tuple[float, float]
    """95 %, of the mean; Student's, since few runs tell the scatter between them."""
    disagreeing: tuple[Disagreement, ...]
