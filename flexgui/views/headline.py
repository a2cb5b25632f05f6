"""The model after the diagnosis, and beside it the first fit of the model as given."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from flexgui.core.effects import catalogue
from flexgui.core.identify.unknowns import GAIN, OFFSET
from flexgui.core.information_criteria import information_criteria
from flexgui.core.results import (
    MISSING,
    NOTHING,
    UNJUDGED,
    UNLISTED,
    Diagnosis,
    Estimate,
    InformationCriteria,
    Outcome,
    RecordingComparison,
)
from flexgui.core.results.identification import RECORDING_MARK
from flexgui.core.sentences import listed
from flexgui.sentences.figures import error_change
from flexgui.sentences.verdict import is_explained, verdict_paragraphs
from flexgui.views.names import is_of_a_start
from flexgui.views.pooled import derived_names, overall_estimates

BIASED = "as given; biased, because an effect was missing"
COMPLETE = "±\N{NO-BREAK SPACE}values hold only if the model is complete."
STILL_MISSING = "An effect is still missing, so these values are biased too."
ENDS = {
    MISSING: "something is still missing",
    NOTHING: "nothing more is missing",
    UNLISTED: "something is still missing that no listed effect explains",
    UNJUDGED: "it cannot be judged whether more is missing",
    None: "the search for more effects was stopped",
}
"""Verdict after the ladder -> its words."""
PLACES = {"arm": "arm", "drive": "drive", "sensor": "sensors"}


def has_added_effects(outcome: Outcome) -> bool:
    """Whether the diagnosis added effects to the model."""
    diagnosis = outcome.diagnosis
    return diagnosis is not None and bool(diagnosis.added)


def current_verdict(diagnosis: Diagnosis) -> str:
    """The verdict on the model after the diagnosis, in a sentence."""
    if not diagnosis.added:
        return next(iter(verdict_paragraphs(diagnosis)), "")
    first, last = diagnosis.steps[0], diagnosis.steps[-1]
    above = diagnosis.final_verdict == NOTHING and not is_explained(diagnosis)
    end = "no other missing effect is found" if above else ENDS[diagnosis.final_verdict]
    verdict = f"With {kept_effects(diagnosis)} {end}"
    return f"{verdict}: {error_change(first, last)}."


def kept_effects(diagnosis: Diagnosis) -> str:
    """Titles of the effects that the diagnosis added and kept."""
    there = {str(entry["id"]) for entry in diagnosis.effects}
    steps = [s for s in diagnosis.steps if s.added is not None]
    return listed([s.title for s in steps if s.added in there] or [s.title for s in steps])


def final_estimates(outcome: Outcome) -> tuple[Estimate, ...]:
    """Parameters of the model after the diagnosis: of the diagnosis' last fit if there is one. The
    first states of recordings, dozens of numbers, stand with their fits alone."""
    diagnosis = outcome.diagnosis
    if diagnosis is None or not diagnosis.parameters:
        return _without_starts(overall_estimates(outcome.fits))
    first = {e.name: e.start for e in first_estimates(outcome)}
    # Each refit starts where the one before it ended; what a person stated is the first start.
    shared = [replace(e, start=first.get(e.name, float("nan"))) for e in diagnosis.parameters]
    labels = {e.label: e for e in first_estimates(outcome) if e.recording}
    # What belongs to a recording has moved with the rest; how sure it is was not asked again.
    moved = [
        replace(e, value=diagnosis.values[label], std=float("nan"))
        for label, e in labels.items()
        if label in diagnosis.values
    ]
    return (*shared, *moved)


def fitted_values(outcome: Outcome | None, recording: str) -> dict[str, float]:
    """name -> value for a recording: its own fit's, else the mean over the fits."""
    fits = () if outcome is None else outcome.fits
    own = tuple(fit for fit in fits if recording in fit.recordings) or fits
    return estimated_values([e for fit in own for e in fit.estimates], recording)


def estimated_values(estimates: Iterable[Estimate], recording: str) -> dict[str, float]:
    """name -> value of the model for a recording: of several estimates of a name the mean."""
    values: dict[str, list[float]] = {}
    for e in estimates:
        if e.recording in (None, recording) and not e.name.startswith((OFFSET, GAIN)):
            values.setdefault(e.name, []).append(e.value)
    return {name: float(np.mean(found)) for name, found in values.items()}


def first_estimates(outcome: Outcome) -> tuple[Estimate, ...]:
    """Estimates of the first fit, of the model as given, without first states."""
    return _without_starts(outcome.as_given or overall_estimates(outcome.fits))


def _without_starts(estimates: Sequence[Estimate]) -> tuple[Estimate, ...]:
    return tuple(e for e in estimates if not is_of_a_start(e))


def first_is_biased(outcome: Outcome) -> bool:
    """Whether an effect was missing in the model as given."""
    return outcome.diagnosis is not None and outcome.diagnosis.verdict == MISSING


def final_is_biased(outcome: Outcome) -> bool:
    """Whether a known effect is still missing after the diagnosis."""
    return outcome.diagnosis is not None and outcome.diagnosis.standing_verdict == MISSING


def owner_of(outcome: Outcome, name: str) -> str:
    """'arm', 'drive', 'sensor', or the id of the effect that has the parameter."""
    diagnosis = outcome.diagnosis
    own = {} if diagnosis is None else diagnosis.origins
    return own.get(name) or outcome.origins.get(name) or "arm"


def owner_title(outcome: Outcome, name: str) -> str:
    """The owner as text: 'arm', 'sensors', 'Coulomb friction'."""
    kind = owner_of(outcome, name)
    effect = catalogue().get(kind)
    titles = {s.added: s.title for s in outcome.diagnosis.steps} if outcome.diagnosis else {}
    return PLACES.get(kind) or (titles.get(kind, kind) if effect is None else effect.title)


def final_derived_names(outcome: Outcome) -> frozenset[str]:
    """Names of the quantities that are computed from estimates."""
    diagnosis = outcome.diagnosis
    if diagnosis is None or not diagnosis.parameters:
        return derived_names(outcome.fits)
    estimated = {label.partition(RECORDING_MARK)[0] for label in diagnosis.values}
    return frozenset(e.name for e in diagnosis.parameters if e.name not in estimated)


def final_comparisons(outcome: Outcome) -> tuple[RecordingComparison, ...]:
    """Measured against the model after the diagnosis."""
    diagnosis = outcome.diagnosis
    if diagnosis is None:
        return outcome.comparisons
    return diagnosis.left or (() if diagnosis.added else diagnosis.given) or outcome.comparisons


def criteria(outcome: Outcome) -> InformationCriteria | None:
    """AIC, BIC and FPE of the model after the diagnosis, against its noise."""
    diagnosis = outcome.diagnosis
    if diagnosis is None:
        return None if outcome.left is None else information_criteria(outcome.left)
    left, noise = diagnosis.steps[-1].left, diagnosis.noise
    return None if left is None else information_criteria(left, noise)


def comparisons_as_given(outcome: Outcome) -> tuple[RecordingComparison, ...]:
    """Measured against the model as given; empty if the model has not changed."""
    diagnosis = outcome.diagnosis
    return diagnosis.given if diagnosis is not None and diagnosis.left else ()


def of_same_recording(
    comparison: RecordingComparison, others: tuple[RecordingComparison, ...]
) -> RecordingComparison | None:
    """The comparison of the same recording among others; None if there is none."""
    return next((c for c in others if c.recording == comparison.recording), None)
