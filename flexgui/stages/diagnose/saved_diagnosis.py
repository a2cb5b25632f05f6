"""A run that was saved, as the versions of a session: the model as given, then each effect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from flexgui.core.diagnosed_scenario import diagnosed_scenario
from flexgui.core.effects import catalogue
from flexgui.core.results import (
    Diagnosis,
    DiagnosisRound,
    LadderStep,
    Outcome,
    RankedEffect,
    RecordingComparison,
)
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.session.state import Topic
from flexgui.stages.diagnose.model_versions import ModelFindings, ModelVersion
from flexgui.stages.diagnose.task import MOST_ROWS, laws_of

if TYPE_CHECKING:
    from flexgui.session.session import Session


def show_run(session: Session, scenario: Scenario, outcome: Outcome) -> None:
    """Puts a run into a session whose folder holds the scenario's files; nothing is computed."""
    versions = versions_of(scenario, outcome)
    last = versions[-1].scenario if versions else scenario
    session.start_with(last)
    session.identification.take(outcome, last)
    session.diagnosis.versions = versions
    for k, version in enumerate(versions):
        if version.comparisons:
            session.diagnosis.models.add(versions[: k + 1], sum(outcome.seconds.values()))
    session.notify(Topic.OUTCOME, Topic.DIAGNOSIS)
    session.playback.refresh()


def versions_of(scenario: Scenario, outcome: Outcome) -> tuple[ModelVersion, ...]:
    """One per step of the outcome's ladder; none without a diagnosis. What was tried at a step is
    listed without its predictions, which are not saved."""
    found = outcome.diagnosis
    if found is None:
        return ()
    steps, end = found.steps, len(found.steps) - 1
    rounds = [found.rounds[k : k + 1] for k in range(len(steps))]
    versions = [_as_given(scenario, outcome, found, rounds[0])]
    for k, step in enumerate(steps[1:], start=1):
        is_last = k == end
        stands = replace(found, verdict=found.standing_verdict, rounds=rounds[k], words=())
        seen = found.left if is_last else ()
        version = ModelVersion(
            _grown(scenario, found, step, is_last),
            step.title,
            step.added,
            _findings(step, seen, rounds[k], stands if is_last else None),
            outcome if is_last else None,
            seen,
        )
        versions.append(version)
    return tuple(versions)


def _as_given(
    scenario: Scenario, outcome: Outcome, found: Diagnosis, rounds: tuple[DiagnosisRound, ...]
) -> ModelVersion:
    """The first version, with the laws of the effect that ranks first on it."""
    given, grown = found.given or outcome.comparisons, len(found.steps) > 1
    first = replace(found, final_verdict=None, steps=found.steps[:1], rounds=rounds, effects=())
    findings = _findings(found.steps[0], given, rounds, first if grown else found)
    if findings.ranking:
        best = findings.ranking[0]
        laws = laws_of(base_model(scenario), given, best)
        findings = replace(findings, laws=laws, laws_of=best.effect if laws else "")
    alone = None if grown else outcome
    return ModelVersion(scenario, found=findings, outcome=alone, comparisons=given)


def _grown(scenario: Scenario, found: Diagnosis, step: LadderStep, is_last: bool) -> Scenario:
    """The scenario as it was stated with the effects of one step, at the values that they had."""
    if not is_last:
        stated = {e.id for e in scenario.model.effects}
        added = [{"id": kind} for kind in step.model if kind in catalogue() and kind not in stated]
        values = {e.label: e.value for e in step.parameters}
        found = replace(found, effects=tuple(added), values=values)
    grown = diagnosed_scenario(scenario, found)
    return scenario.model_copy(update={"model": grown.model, "arm": grown.arm})


def _findings(
    step: LadderStep, compared: Sequence[RecordingComparison],
    rounds: Sequence[DiagnosisRound], diagnosis: Diagnosis | None,
) -> ModelFindings:  # fmt: skip
    """What is shown of a step, from the comparisons of its fit."""
    floors = {e.channel: e.floor for e in step.errors}
    fitted = [c for c in compared if c.role == "estimate"]
    channels = [[c for c in each.channels if c.fitted and c.channel in floors] for each in fitted]
    ranking: tuple[RankedEffect, ...] = rounds[0].ranking if rounds else ()
    times = [each[0].time for each in channels if each]
    strides = [max(-(-len(time) // MOST_ROWS), 1) for time in times]
    return ModelFindings(
        step=step,
        recordings=tuple(c.recording for c, each in zip(fitted, channels, strict=True) if each),
        channels=tuple(tuple(c.channel for c in each) for each in channels if each),
        dt=tuple(float(t[1] - t[0]) * s for t, s in zip(times, strides, strict=True)),
        residual=tuple(
            np.column_stack([np.where(c.counted, c.residual, np.nan) / floors[c.channel]
                             for c in each])[::stride]
            for each, stride in zip(filter(None, channels), strides, strict=True)
        ),
        ranking=ranking,
        diagnosis=diagnosis,
    )  # fmt: skip
