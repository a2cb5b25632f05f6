"""All that a scenario's run produced."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from core.results.comparison import RecordingComparison, Variant
from core.results.description import DescriptorModel, Equation
from core.results.diagnosis import Diagnosis
from core.results.identification import Estimate, Fit
from core.results.mechanism import Mechanism
from core.results.repeated import Repeated


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
