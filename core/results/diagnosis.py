"""What a model lacks, and how the error fell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..results.comparison import RecordingComparison
from ..results.criteria import ErrorProducts
from ..results.identification import Estimate
from ..results.objection import Doubt, Objection, PlannedExperiment
from ..results.proposal import Proposal

MISSING, NOTHING, UNLISTED = "missing", "nothing_missing", "unlisted"
UNJUDGED = "cannot_be_judged"

ABOVE = 1.06
"""Times the floor: from this rms on an error is well above it. Noise coloured by a filter of ten
samples moves the rms of a few seconds of four channels by one per cent."""

ABOVE_IN_ONE = 1.2
"""The same for the worst channel alone."""


@dataclass(frozen=True)
class Remains:
    """What is left of the error, in floors."""

    rms: float = float("nan")
    """Over all channels."""
    by_channel: Mapping[str, float] = field(default_factory=dict)
    line: tuple[str, float] | None = None
    """(channel, Hz) of a spectral line in an error above the floor that nothing explains."""
    within: Mapping[str, float] = field(default_factory=dict)
    """channel -> the factor within which its floor is known; one where nothing is said"""
    rms_within: float = 1.0
    """The same over all channels."""
    idealised: Mapping[str, float] = field(default_factory=dict)
    """channel -> mean square that the laws of the effects in the model may miss"""
    all_idealised: float = 0.0
    """The same over all channels."""
    tolerated: Mapping[str, float] = field(default_factory=dict)
    """channel -> mean square that a person allows the model to miss"""
    all_tolerated: float = 0.0
    """The same over all channels."""
    over_noise: float = float("nan")
    """Over all channels, in noise alone, where that is above it and a tolerance allows it; else
    NaN."""

    @property
    def above(self) -> bool:
        """Whether the error exceeds the noise floors, however well these are known, and what the
        laws in the model may miss."""
        limits = {
            n: (ABOVE_IN_ONE * self.within.get(n, 1.0)) ** 2 + self.idealised.get(n, 0.0)
            for n in self.by_channel
        }
        whole = (ABOVE * self.rms_within) ** 2 + self.all_idealised
        return self.rms**2 > whole or any(x**2 > limits[n] for n, x in self.by_channel.items())

    @property
    def beyond_tolerance(self) -> bool:
        """Whether it exceeds what a person allows the model to miss as well."""
        allowed = {n: self.idealised.get(n, 0.0) + x for n, x in self.tolerated.items()}
        whole = self.all_idealised + self.all_tolerated
        return replace(self, idealised={**self.idealised, **allowed}, all_idealised=whole).above

    @property
    def above_floors(self) -> bool:
        """Whether it would if floors and laws were known exactly."""
        return replace(self, within={}, rms_within=1.0).above_exact_laws

    @property
    def above_exact_laws(self) -> bool:
        """Whether it would if the laws in the model were exact."""
        return replace(self, idealised={}, all_idealised=0.0).above


@dataclass(frozen=True)
class ChannelError:
    """The error of one channel over all recordings of a role."""

    channel: str
    """Such as 'z1' (tip) or 'theta1' (joint)."""
    unit: str
    """SI, of all its values."""
    rms: float
    """Root mean square over the estimation recordings."""
    floor: float
    """Below which an error says nothing: noise and fidelity."""
    validation_rms: float = float("nan")
    """The same on the recordings that no fit has seen; NaN without any."""
    floor_source: str = ""
    """Where the floor's noise comes from: repetition, stated or estimated; empty: unknown."""


@dataclass(frozen=True)
class LadderStep:
    """One step of the error ladder: the model after an effect was added (None: as given)."""

    added: str | None
    """Id of the effect."""
    title: str
    """What the step did, in words."""
    parameters: tuple[Estimate, ...]
    """Sizes of the added effect first, then of the others as they stand after the step, then of the
    arm; all unknowns for the first step."""
    errors: tuple[ChannelError, ...]
    """One per output."""
    tip_rms: float | None
    """m, over the estimation recordings; None without a camera."""
    cost_per_sample: float
    """Mean squared error in floors: 1 is the floor."""
    model: tuple[str, ...] = ()
    """Ids of all effects in the model at this step, those that others include too."""
    fit_percent: tuple[float, ...] = ()
    """FIT per channel over the estimation recordings, in the order of `errors`: 100 % is no error,
    0 % no better than the mean."""
    validation_fit_percent: tuple[float, ...] = ()
    """The same on the recordings that no fit has seen."""
    left: ErrorProducts | None = field(default=None, compare=False)
    """Its errors, for BIC."""


@dataclass(frozen=True)
class RankedEffect:
    """One candidate of a round."""

    effect: str
    """Its id."""
    title: str
    """Its name in words."""
    score: float
    """Whitened score, without a unit; chi-squared where the effect is absent."""
    p_value: float
    """Of the score; corrected for all that was tried."""
    expected_drop_percent: float
    """%, of the squared error above the floor, by the linear screen."""
    refit_drop_percent: float | None
    """The same by a full refit; None where none was made."""
    delta_bic: float | None
    """Fall of the Bayesian information criterion by the refit, of the effect that was added by its
    step; positive speaks for the effect."""
    confused_with: tuple[str, ...] = ()
    """Ids of the effects that these recordings do not distinguish from it."""
    parameters: tuple[Estimate, ...] = ()
    """Its sizes."""
    tied_to: tuple[Estimate, ...] = ()
    """Parameters of the model that it cannot be distinguished from, where it explains too little.

    Values with the effect; `start` has those without."""
    predicted: tuple[np.ndarray, ...] = ()
    """(M, k) per recording in floors: the residual that the effect predicts."""
    unseen_rms: float = float("nan")
    """Validation error of its refit, in floors, where that decides among similar effects."""
    left: ErrorProducts | None = field(default=None, compare=False)
    """Errors of its refit, for BIC."""


@dataclass(frozen=True)
class DiagnosisRound:
    """One round: the ranking on the model so far, and what was added."""

    ranking: tuple[RankedEffect, ...]
    accepted: str | None
    refused: tuple[tuple[str, Objection], ...] = ()
    """(title, why) of effects that explain enough and were not added, or were taken out again."""
    diverged: tuple[str, ...] = ()
    """Titles of effects that could not be simulated at any size that was tried."""
    experiments: tuple[PlannedExperiment, ...] = ()
    """Where two effects could not be distinguished: what to do next, best first."""


@dataclass(frozen=True)
class LinearModel:
    """What the linear model misses and the full equations do not: a matter of the model, never of
    the arm."""

    tip_rms: float | None
    """m"""
    full_equations_tip_rms: float | None
    """m"""
    tip_floor: float = float("nan")
    """m, noise of the tip."""
    moved: tuple[Estimate, Estimate] | None = None
    """What is most different between the linear model's fit and that of the full equations, where
    the two stand in different places."""


@dataclass(frozen=True)
class Diagnosis:
    """What is missing, how sure, and how the error fell."""

    verdict: str
    """missing, nothing_missing, unlisted or cannot_be_judged: of the model as given"""
    final_verdict: str | None
    """The same of what remains after the ladder; None where nothing was to be added."""
    rounds: tuple[DiagnosisRound, ...]
    steps: tuple[LadderStep, ...]
    not_applicable: Mapping[str, str]
    """effect -> why this rig cannot show it, or why it cannot be"""
    effects: tuple[Mapping[str, Any], ...] = ()
    """What was accepted, as [model] effects of a scenario."""
    floors: Mapping[str, float] = field(default_factory=dict)
    seconds: Mapping[str, float] = field(default_factory=dict)
    stopped: bool = False
    """Whether the user stopped the search before it was complete."""
    kept: tuple[str, ...] = ()
    """Ids of the effects that were added and are in the model at the end."""
    needless: tuple[str, ...] = ()
    """Titles of those that were added on the way and are not needed at the end."""
    limit: int = 0
    """How many effects were to be added at most; 0: they are only proposed."""
    error_given: Remains = Remains()
    """Of the model as given."""
    error_left: Remains = Remains()
    """After the last step."""
    words: tuple[str, ...] = ()
    """Paragraphs of the verdict in place of those made of these facts; empty: none."""
    given: tuple[RecordingComparison, ...] = ()
    """Measured against the model as given, as the ladder counts: where it failed."""
    left: tuple[RecordingComparison, ...] = ()
    """The same after the last step; empty where nothing was added."""
    parameters: tuple[Estimate, ...] = ()
    """All that is estimated, of the model as it stands at the end."""
    origins: Mapping[str, str] = field(default_factory=dict)
    """Name of a parameter -> arm, drive, sensor, or the id of the effect it belongs to."""
    values: Mapping[str, float] = field(default_factory=dict)
    """label -> value of every unknown at the end, those of single recordings too."""
    linear_model: LinearModel | None = None
    """What the linear model costs on these recordings, where it was the one identified."""
    ruled_out: Mapping[str, str] = field(default_factory=dict)
    """Title of an effect or of its parameters that [rig] excludes -> the statement."""
    proposed: tuple[str, ...] = ()
    """Ids of effects that pass every test and were not added, the first to add first."""
    shapes: tuple[int, ...] = ()
    """Bending shapes per segment that the recordings show, where these are more than stated."""
    proposal: Proposal | None = None
    """Laws for what is left, where no listed effect explains it and they were looked for."""
    doubts: tuple[Doubt, ...] = ()
    """Why the model as it now stands cannot be judged."""
    unstated_noise: tuple[str, ...] = ()
    """Settings of [sensors] for the noise of what is compared or followed, which nobody stated."""
    noise: ErrorProducts | None = field(default=None, compare=False)
    """What neither the last model nor any candidate explains: it whitens all errors for BIC."""

    @property
    def added(self) -> tuple[str, ...]:
        """Ids of the effects that were added on the ladder; some may have become needless."""
        return tuple(step.added for step in self.steps if step.added is not None)

    @property
    def standing_verdict(self) -> str:
        """Of the model as it now stands."""
        return self.final_verdict or self.verdict

    @property
    def unfinished(self) -> bool:
        """Whether the search was stopped before it named anything, with an error above the
        noise."""
        return self.stopped and self.verdict == UNJUDGED and self.error_given.above

    @property
    def ranking(self) -> tuple[RankedEffect, ...]:
        """That of the first round."""
        return self.rounds[0].ranking if self.rounds else ()
