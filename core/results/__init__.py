"""Frozen records of what was found; written as JSON and CSV, never pickled."""

from ..results.comparison import (
    ChannelComparison,
    ErrorMap,
    ErrorMaps,
    ErrorOver,
    InputSignal,
    JointMotion,
    MissingTorque,
    RecordingComparison,
    Variant,
    WorstCell,
)
from ..results.criteria import ErrorProducts, InformationCriteria
from ..results.diagnosis import (
    ABOVE,
    ABOVE_IN_ONE,
    MISSING,
    NOTHING,
    UNJUDGED,
    UNLISTED,
    ChannelError,
    Diagnosis,
    DiagnosisRound,
    LadderStep,
    LinearModel,
    RankedEffect,
    Remains,
)
from ..results.identification import Estimate, Fit, Generation, Identifiability, Profile, Valley
from ..results.objection import Doubt, DoubtReason, Objection, PlannedExperiment, Reason
from ..results.outcome import (
    DescriptorModel,
    Disagreement,
    Equation,
    LevelChoice,
    Link,
    Mechanism,
    Outcome,
    PresentEffect,
    Repeated,
)
from ..results.proposal import Carrier, Event, LawTerm, Proposal, ProposedLaw
from ..results.state_equations import Quantity, StateEquations
