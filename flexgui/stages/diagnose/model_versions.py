"""The versions of a person's model, the findings about each, and the changes of the error."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, NamedTuple, Protocol

import numpy as np

from flexgui.core.information_criteria import with_evidence
from flexgui.core.parameters import Parameter
from flexgui.core.progress import Progress
from flexgui.core.results import (
    MISSING,
    ChannelError,
    Diagnosis,
    DiagnosisRound,
    Estimate,
    Event,
    LadderStep,
    LinearModel,
    Outcome,
    ProposedLaw,
    RankedEffect,
    RecordingComparison,
)
from flexgui.core.scenario.schema import Scenario
from flexgui.sentences.figures import error_change, times
from flexgui.sentences.verdict import verdict_paragraphs
from flexgui.sentences.written import format_number
from flexgui.views.over_speed import OverSpeed
from flexgui.views.pooled import overall_estimates


@dataclass(frozen=True)
class ModelVersion:
    """One version of the model, and what was found about it."""

    scenario: Scenario
    title: str = ""
    """Of the effect that was added or removed since the version before."""
    added: str | None = None
    """The effect's id where one was added."""
    found: ModelFindings | None = None
    """None until the worker has reported something."""
    outcome: Outcome | None = None
    comparisons: tuple[RecordingComparison, ...] = ()
    """Measured against this version's own fit; empty until the worker has reported them."""

    @property
    def ranking(self) -> tuple[RankedEffect, ...]:
        """The ranked effects; empty before there are any."""
        return () if self.found is None else self.found.ranking

    @property
    def diagnosis(self) -> Diagnosis | None:
        """None while the worker still searches."""
        return None if self.found is None else self.found.diagnosis

    @property
    def error(self) -> float:
        """Rms error over all outputs, in noise floors."""
        step = None if self.found is None else self.found.step
        return float("nan") if step is None else float(np.sqrt(step.cost_per_sample))


def versions_before(
    versions: Sequence[ModelVersion], version: ModelVersion
) -> tuple[ModelVersion, ...]:
    """The versions kept before this one: all, those up to the same model, or none. Errors of other
    settings than its own are no steps of its ladder."""
    same = [k for k, each in enumerate(versions) if each.scenario == version.scenario]
    if version.title and not same:
        return tuple(versions) if _of_same_settings(versions[-1:], version.scenario) else ()
    return tuple(versions[: same[-1]]) if same else ()


def _of_same_settings(versions: Sequence[ModelVersion], scenario: Scenario) -> bool:
    """But for the model, and for what is known of the rig, which changes no error."""
    free = {"model": scenario.model, "rig": scenario.rig}
    return all(each.scenario.model_copy(update=free) == scenario for each in versions)


def ladder_steps(versions: Sequence[ModelVersion]) -> tuple[LadderStep, ...]:
    """All steps so far, in the noise floors of the last one."""
    with_step = [(version, version.found.step) for version in versions if version.found is not None]
    floors = {e.channel: e.floor for _, step in with_step[-1:] for e in step.errors}
    steps = [
        replace(step, added=version.added, title=version.title) if k else step
        for k, (version, step) in enumerate(with_step)
    ]
    return (*(step_in_floors(step, floors) for step in steps[:-1]), *steps[-1:])


def restated(versions: Sequence[ModelVersion]) -> str:
    """Why the first row of the ladder is not what it was; empty where it is."""
    steps = ladder_steps(versions)
    first = next((version.error for version in versions if version.found is not None), math.nan)
    if len(steps) < 2 or times(math.sqrt(steps[0].cost_per_sample)) == times(first):
        return ""
    return (
        "Each model has its own estimate of the noise floor; all rows are in that of the newest "
        f"one. In its own, the error of the first was {times(first)} the noise floor."
    )


def step_in_floors(step: LadderStep, floors: dict[str, float]) -> LadderStep:
    """The step in other noise floors, as the estimated noise differs a little each time."""
    errors = tuple(replace(e, floor=floors.get(e.channel, e.floor)) for e in step.errors)
    factor = _square(errors) / _square(step.errors) if step.errors else 1.0
    return replace(step, errors=errors, cost_per_sample=step.cost_per_sample * factor)


def _square(errors: Sequence[ChannelError]) -> float:
    return float(np.mean([(e.rms / e.floor) ** 2 for e in errors]))


def combined_diagnosis(versions: Sequence[ModelVersion]) -> Diagnosis | None:
    """All versions as one diagnosis, for the report; None without a complete one."""
    complete = [version.diagnosis for version in versions if version.diagnosis is not None]
    if not complete:
        return None
    last, steps, whole = versions[-1], ladder_steps(versions), len(versions) > 1
    stands = last.diagnosis or _unseen(complete[-1], steps[-1])
    combined = replace(
        stands,
        verdict=MISSING if whole else stands.verdict,
        final_verdict=last.diagnosis.verdict if whole and last.diagnosis else None,
        rounds=_rounds(versions),
        steps=steps,
        words=(
            *verdict_paragraphs(stands),
            *(f"{b.title}: {error_change(a, b)}." for a, b in pairwise(steps)),
        ),
        effects=tuple(e.model_dump() for e in last.scenario.model.effects),
        floors={e.channel: e.floor for e in steps[-1].errors},
        given=versions[0].comparisons,
        left=last.comparisons if whole else (),
    )
    return with_evidence(combined)


def _unseen(before: Diagnosis, step: LadderStep) -> Diagnosis:
    """Diagnosis of a model that is only fitted; the rest is from the one before."""
    values = {e.name: e.value for e in step.parameters}
    return replace(
        before,
        words=(INCOMPLETE,),
        parameters=step.parameters,
        values=values,
        stopped=False,
        proposal=None,
    )


def _rounds(versions: Sequence[ModelVersion]) -> tuple[DiagnosisRound, ...]:
    """The ranking of each version, with the effect that was added after it."""
    following = [*[version.added for version in versions[1:]], None]
    # The version's own list also holds the formulas that were tried on its model.
    return tuple(
        replace(one, ranking=version.ranking or one.ranking, accepted=added)
        for version, added in zip(versions, following, strict=True)
        for one in (version.diagnosis.rounds[:1] if version.diagnosis else ())
    )


COMPARED_BY = (
    "Compared as in the diagnosis: the initial state of each recording is fitted too. So all "
    "figures agree with the error ladder."
)


def with_versions(
    outcome: Outcome, shown: tuple[RecordingComparison, ...], versions: Sequence[ModelVersion]
) -> Outcome:
    """The outcome of the last version with the whole way, as the report states it; `shown`: the
    comparisons in place of its own, if any."""
    compared = shown or outcome.comparisons
    notes = outcome.notes if compared is outcome.comparisons else (*outcome.notes, COMPARED_BY)
    diagnosis = combined_diagnosis(versions)
    diagnosis = diagnosis and replace(diagnosis, linear_model=linear_model_of(versions))
    given = first_estimates(versions) if diagnosis is not None and diagnosis.added else ()
    return replace(outcome, comparisons=compared, notes=notes, diagnosis=diagnosis, as_given=given)


def first_estimates(versions: Sequence[ModelVersion]) -> tuple[Estimate, ...]:
    """Of the way's first model."""
    first = next(iter(versions), None)
    if first is None:
        return ()
    if first.outcome is not None:
        return overall_estimates(first.outcome.fits)
    return () if first.found is None else first.found.step.parameters


def linear_model_of(versions: Sequence[ModelVersion]) -> LinearModel | None:
    """What the linear model costs, where the first model was identified with it."""
    from flexgui.core.workbench import linear_model

    first = next(iter(versions), None)
    if first is None or first.diagnosis is None or first.outcome is None:
        return None
    if first.outcome.level != "lpv":
        return None
    return linear_model(first.outcome.fits, first.outcome.comparisons, first.diagnosis)


INCOMPLETE = "The search for more missing effects was not complete."

FELL = 0.99
"""Share of the error: what falls by less is not seen in its two figures."""


class Change(NamedTuple):
    """Rms error before and after, in noise floors of the last version."""

    before: float
    after: float

    @property
    def fell(self) -> bool:
        """Whether the error fell by a noticeable share."""
        return self.after < FELL * self.before

    @property
    def rose(self) -> bool:
        """Whether the error rose by a noticeable share."""
        return self.before < FELL * self.after

    @property
    def words(self) -> str:
        """`from 9.7 to 0.99 times the noise floor`"""
        before = format_number(self.before, 2, keep_zeros=True)
        return f"from {before} to {times(self.after)} the noise floor"


def last_change(versions: Sequence[ModelVersion]) -> Change | None:
    """The last change of the error; None with fewer than two versions."""
    steps = ladder_steps(versions)
    if len(steps) < 2:
        return None
    before, after = (float(step.cost_per_sample**0.5) for step in steps[-2:])
    return Change(before, after)


def last_step_sentence(versions: Sequence[ModelVersion]) -> str:
    """How the error changed in the last step."""
    last, change = versions[-1], last_change(versions)
    if change is None:
        return f"{last.title}: error {times(last.error)} the noise floor."
    return f"{last.title}: error {change.words}."


def stopped_sentence(kept: bool, any_left: bool) -> str:
    """What there is after a stop: this result, if `kept`, or an earlier one."""
    if kept:
        return "Stopped; this is the result so far."
    return "Stopped; the last complete result is kept." if any_left else "Stopped."


def proposed_laws(version: ModelVersion | None) -> tuple[ProposedLaw, ...]:
    """Those that are proposed for a version."""
    found = None if version is None else version.diagnosis
    return () if found is None or found.proposal is None else found.proposal.laws


def proposed_events(version: ModelVersion | None) -> tuple[Event, ...]:
    """What happened once in recordings, as far as a version shows it."""
    found = None if version is None else version.diagnosis
    return () if found is None or found.proposal is None else found.proposal.events


def error_stayed(versions: Sequence[ModelVersion]) -> bool:
    """Whether the last step added an effect and the error did not fall."""
    change = last_change(versions)
    return bool(versions[-1:] and versions[-1].added) and change is not None and not change.fell


def error_rose(versions: Sequence[ModelVersion]) -> bool:
    """Whether the last step added an effect and the error rose."""
    change = last_change(versions)
    return bool(versions[-1:] and versions[-1].added) and change is not None and change.rose


@dataclass(frozen=True)
class ModelFindings:
    """Errors of one model, and the effects that could be missing in it."""

    step: LadderStep
    recordings: tuple[str, ...]
    """That the model was fitted to."""
    channels: tuple[tuple[str, ...], ...]
    """Of each recording."""
    dt: tuple[float, ...]
    """s between the rows of `residual` and of the predictions."""
    residual: tuple[np.ndarray, ...]
    """(rows, channels) per recording, in floors."""
    ranking: tuple[RankedEffect, ...] = ()
    """As it stands; predictions have the rows of `residual`."""
    to_come: int = 0
    """Sizes of effects that are still to be tried before the ranking is more than a first one."""
    untried: tuple[str, ...] = ()
    """Titles of effects of which no size was tried yet."""
    diagnosis: Diagnosis | None = None
    """Once it is complete."""
    laws: tuple[tuple[OverSpeed, ...], ...] = ()
    """For each compared recording, of the first of the ranking; empty where it is no such law."""
    laws_of: str = ""
    """Id of that effect."""
    outcome: Outcome | None = None
    """Of the identification that went with it, where there was one."""


class PartialProgress(Progress, Protocol):
    """A progress that also takes intermediate results."""

    def partial(self, name: str, value: Any) -> None:
        """Reports an intermediate result; it replaces earlier ones of the same name."""


@dataclass(frozen=True)
class Demonstration:
    """One output of one recording with and without an effect."""

    kind: str
    title: str
    recording: str
    channel: str
    unit: str
    time: np.ndarray
    """(N,) s, a stretch of the recording"""
    measured: np.ndarray
    without: np.ndarray
    """(N,) of the model with everything else in it"""
    with_it: np.ndarray
    sizes: tuple[Parameter, ...]
    """Of the effect, at the values that were simulated."""
    torques: tuple[OverSpeed, ...] = ()
    """What the effect does to each joint, over its speed; empty where no such law says it."""
