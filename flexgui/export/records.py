"""Which fields of the records of a result leave it, under which names: for JSON and for tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from flexgui.core.results import (
    ChannelComparison,
    ChannelError,
    DiagnosisRound,
    Estimate,
    Fit,
    Identifiability,
    LadderStep,
    LinearModel,
    PlannedExperiment,
    RankedEffect,
    RecordingComparison,
    Valley,
    Variant,
    WorstCell,
)
from flexgui.sentences.experiments import experiment_sentence, experiment_title
from flexgui.sentences.identifiability import identifiability_sentences, invariant
from flexgui.sentences.ranked import round_sentence
from flexgui.views.pooled import derived_names

Shape = Mapping[str, str | Callable[[Any], Any]]
"""Name outside -> field, or what makes it of the record."""


def as_record(value: Any) -> Any:
    """A record, or a sequence of them, as plain mappings; anything else as it is."""
    if shape := SHAPES.get(type(value)):
        return {
            name: as_record(source(value) if callable(source) else getattr(value, source))
            for name, source in shape.items()
        }
    if isinstance(value, tuple | list):
        return [as_record(each) for each in value]
    return value


def _fields(names: str) -> dict[str, str | Callable[[Any], Any]]:
    """Fields that keep their names, which stand between blanks."""
    return {name: name for name in names.split()}


def _parameters(fit: Fit) -> list[dict[str, Any]]:
    derived = derived_names([fit])
    return [{**as_record(e), "derived": e.name in derived} for e in (*fit.estimates, *fit.derived)]


def _identifiability(fit: Fit) -> dict[str, Any]:
    found = fit.identifiability
    sentences = {"sentences": identifiability_sentences(fit)}
    return {**as_record(found), **sentences, "valley": as_record(found.valley)}


SHAPES: Mapping[type, Shape] = {
    ChannelComparison: {
        **_fields("channel unit fitted"),
        "samples": lambda channel: int(channel.counted.sum()),
        **_fields("fit_percent rms normalised_error relative_error"),
    },
    ChannelError: {
        **_fields("channel unit rms floor"),
        "floor_source": lambda error: error.floor_source or None,
        "validation_rms": "validation_rms",
    },
    DiagnosisRound: {
        "accepted": "accepted",
        "sentence": round_sentence,
        "ranking": "ranking",
        "next_experiments": "experiments",
    },
    Estimate: {
        **_fields("name value std unit identifiable symbol start lower upper at_bound recording"),
        "derived": lambda _: False,
    },
    Fit: {
        **_fields("label recordings"),
        "parameters": _parameters,
        **_fields("correlation cost residual_count"),
        "generations": lambda fit: len(fit.convergence),
        **_fields("gradient_norm message stopped"),
        "identifiability": _identifiability,
    },
    Identifiability: _fields("names rank singular_values null_directions"),
    LadderStep: {
        **_fields("added title parameters"),
        "tip_rms_m": "tip_rms",
        **_fields("fit_percent validation_fit_percent cost_per_sample errors"),
    },
    LinearModel: {"tip_rms_m": "tip_rms", "full_equations_tip_rms_m": "full_equations_tip_rms"},
    PlannedExperiment: {
        "title": experiment_title,
        **_fields("simulate score"),
        "sentence": experiment_sentence,
    },
    RankedEffect: {
        **_fields("effect title score p_value expected_drop_percent refit_drop_percent delta_bic"),
        "confused_with": "confused_with",
        "tied_to": lambda effect: [e.name for e in effect.tied_to],
        "parameters": "parameters",
    },
    RecordingComparison: {
        "name": "recording",
        "role": "role",
        "fit": "fit_label",
        "tip_rms_m": "tip_rms",
        **_fields("note channels"),
    },
    Valley: {**_fields("names units points cost_ratio"), "invariant": invariant},
    Variant: {"title": "title", "parameters": "estimates", "recordings": "comparisons"},
    WorstCell: _fields("recording channel axis axis_unit low high rms unit ratio"),
}
