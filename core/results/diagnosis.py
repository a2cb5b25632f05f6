"""What a model lacks, and how the error fell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from core.results.comparison import RecordingComparison
from core.results.identification import Estimate


@dataclass(frozen=True)
class ChannelError:
    """The error of one channel over all recordings of a role."""

    channel: str
    unit: str
    rms: float
    floor: float
    """Below which an error says nothing: noise and fidelity."""
    validation_rms: float = float("nan")
    floor_source: str = ""
    """Where the floor's noise comes from: repetition, stated or estimated; empty: unknown."""


@dataclass(frozen=True)
class LadderStep:
    """One step of the error ladder: the model after an effect was added (None: as given)."""

    added: str | None
    title: str
    parameters: tuple[Estimate, ...]
    """Sizes of the added effect first, then of the others as they stand after the step; all
    unknowns for the first step."""
    errors: tuple[ChannelError, ...]
    tip_rms: float | None
    """m, over the estimation recordings; None without a camera."""
    cost_per_sample: float
    """Mean squared error in floors: 1 is the floor."""
    model: tuple[str, ...] = ()
    """Ids of all effects in the model at this step, those that others include too."""
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
    tied_to: tuple[Estimate, ...] = ()
    """What the model had before and these recordings do not tell it from, where it explains too
    little to be accepted: as it would stand with it, with `start` as it stands without."""
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
class LinearModel:
    """What the linear model misses and the full equations do not: a matter of the model, never of
    the arm."""

    tip_rms: float | None
    """m"""
    full_equations_tip_rms: float | None
    """m"""
    sentence: str


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

    @property
    def paragraphs(self) -> tuple[str, ...]:
        """All that is said: what the linear model costs, where it was used, before the verdict."""
        first = () if self.linear_model is None else (self.linear_model.sentence,)
        return (*first, *self.words)

    @property
    def added(self) -> tuple[str, ...]:
        """Ids of the effects that were added on the ladder; some may have become needless."""
        return tuple(step.added for step in self.steps if step.added is not None)

    @property
    def standing_verdict(self) -> str:
        """Of the model as it now stands."""
        return self.final_verdict or self.verdict

    @property
    def ranking(self) -> tuple[RankedEffect, ...]:
        """That of the first round."""
        return self.rounds[0].ranking if self.rounds else ()
