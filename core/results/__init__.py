"""Frozen records of what was found; written as JSON and CSV, never pickled."""

from core.results.comparison import (
    ChannelComparison,
    JointMotion,
    MissingTorque,
    RecordingComparison,
    Variant,
)
from core.results.diagnosis import (
    ChannelError,
    Diagnosis,
    DiagnosisRound,
    LadderStep,
    LinearModel,
    PlannedExperiment,
    RankedEffect,
)
from core.results.identification import Estimate, Fit, Generation, Identifiability, Valley
from core.results.maps import ErrorMap, ErrorMaps, ErrorOver, WorstCell
from core.results.mechanism import Link, Mechanism, PresentEffect
from core.results.outcome import DescriptorModel, Disagreement, Equation, Outcome, Repeated

__all__ = [
    "ChannelComparison",
    "ChannelError",
    "DescriptorModel",
    "Diagnosis",
    "DiagnosisRound",
    "Disagreement",
    "Equation",
    "ErrorMap",
    "ErrorMaps",
    "ErrorOver",
    "Estimate",
    "Fit",
    "Generation",
    "Identifiability",
    "JointMotion",
    "LadderStep",
    "LinearModel",
    "Link",
    "Mechanism",
    "MissingTorque",
    "Outcome",
    "PlannedExperiment",
    "PresentEffect",
    "RankedEffect",
    "RecordingComparison",
    "Repeated",
    "Valley",
    "Variant",
    "WorstCell",
]
