"""The model after the diagnosis, and beside it the first fit of the model as given."""

from __future__ import annotations

from dataclasses import replace

from flexgui.core.effects import catalogue
from flexgui.core.identify.unknowns import RECORDING_MARK
from flexgui.core.results import (
    MISSING,
    NOTHING,
    UNLISTED,
    Diagnosis,
    Estimate,
    Outcome,
    RecordingComparison,
)
from flexgui.core.sentences import listed
from flexgui.sentences.figures import error_change
from flexgui.sentences.verdict import verdict_paragraphs
from flexgui.views.pooled import derived_names, overall_estimates

AS_GIVEN = "As given"
BIASED = "as given; biased, because an effect was missing"
COMPLETE = "±\N{NO-BREAK SPACE}values hold only if the model is complete."
SHORT_OF = "An effect is still missing, so these values are biased too."
ENDS = {
    MISSING: "something is still missing",
    NOTHING: "nothing more is missing",
    UNLISTED: "something is still missing that no listed effect explains",
    None: "the search for more effects was stopped",
}
"""Verdict after the ladder -> its words."""
PLACES = {"arm": "arm", "drive": "drive", "sensor": "sensors"}


def grown(outcome: Outcome) -> bool:
    """Whether the diagnosis put effects into the model."""
    found = outcome.diagnosis
    return found is not None and bool(found.added)


def verdict_now(found: Diagnosis) -> str:
    """The verdict on the model as it now stands, a sentence."""
    if not found.added:
        return next(iter(verdict_paragraphs(found)), "")
    first, last = found.steps[0], found.steps[-1]
    return f"With {kept(found)} {ENDS[found.final_verdict]}: {error_change(first, last)}."


def kept(found: Diagnosis) -> str:
    """What the ladder put into the model and left there."""
    there = {str(entry["id"]) for entry in found.effects}
    steps = [s for s in found.steps if s.added is not None]
    return listed([s.title for s in steps if s.added in there] or [s.title for s in steps])


def standing(outcome: Outcome) -> tuple[Estimate, ...]:
    """The parameters of the model as it now stands: the diagnosis' last fit where there is one."""
    found = outcome.diagnosis
    if found is None or not found.parameters:
        return overall_estimates(outcome.fits)
    first = {e.name: e.start for e in given(outcome)}
    # Each refit starts where the one before it ended; what a person stated is the first start.
    shared = [replace(e, start=first.get(e.name, float("nan"))) for e in found.parameters]
    labels = {f"{e.name}{RECORDING_MARK}{e.recording}": e for e in given(outcome) if e.recording}
    # What belongs to a recording has moved with the rest; how sure it is was not asked again.
    moved = [
        replace(e, value=found.values[label], std=float("nan"))
        for label, e in labels.items()
        if label in found.values
    ]
    return (*shared, *moved)


def given(outcome: Outcome) -> tuple[Estimate, ...]:
    """The estimates of the first fit, of the model as it was given."""
    return outcome.as_given or overall_estimates(outcome.fits)


def given_biased(outcome: Outcome) -> bool:
    """Whether an effect was missing in the model as given."""
    return outcome.diagnosis is not None and outcome.diagnosis.verdict == MISSING


def standing_biased(outcome: Outcome) -> bool:
    """Whether an effect that is known is still missing in the model as it now stands."""
    return outcome.diagnosis is not None and outcome.diagnosis.standing_verdict == MISSING


def belongs_to(outcome: Outcome, name: str) -> str:
    """arm, drive, sensor, or the id of the effect that a parameter belongs to."""
    found = outcome.diagnosis
    own = {} if found is None else found.origins
    return own.get(name) or outcome.origins.get(name) or "arm"


def belongs_in_words(outcome: Outcome, name: str) -> str:
    """The same for a person: 'arm', 'sensors', 'Coulomb friction'."""
    kind = belongs_to(outcome, name)
    effect = catalogue().get(kind)
    own = {s.added: s.title for s in outcome.diagnosis.steps} if outcome.diagnosis else {}
    return PLACES.get(kind) or (own.get(kind, kind) if effect is None else effect.title)


def follows(outcome: Outcome) -> frozenset[str]:
    """Names of the quantities that only follow from estimates."""
    found = outcome.diagnosis
    if found is None or not found.parameters:
        return derived_names(outcome.fits)
    estimated = {label.partition(RECORDING_MARK)[0] for label in found.values}
    return frozenset(e.name for e in found.parameters if e.name not in estimated)


def final_comparisons(outcome: Outcome) -> tuple[RecordingComparison, ...]:
    """Measured against the model as it now stands, by the fit that its parameters are of."""
    found = outcome.diagnosis
    if found is None:
        return outcome.comparisons
    return found.left or (() if found.added else found.given) or outcome.comparisons


def given_comparisons(outcome: Outcome) -> tuple[RecordingComparison, ...]:
    """Measured against the model as given, by a fit of the same kind; empty where the model has
    not changed."""
    found = outcome.diagnosis
    return found.given if found is not None and found.left else ()


def beside(
    comparison: RecordingComparison, others: tuple[RecordingComparison, ...]
) -> RecordingComparison | None:
    """The same recording among others."""
    return next((c for c in others if c.recording == comparison.recording), None)
