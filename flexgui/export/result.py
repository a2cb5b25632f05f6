"""`result.json`: what a script reads (schema 1), and which fields of the records of a result leave
it, under which names; the tables take them from here too."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from flexgui.core.error_maps import error_maps
from flexgui.core.results import (
    Carrier,
    ChannelComparison,
    ChannelError,
    Diagnosis,
    DiagnosisRound,
    Estimate,
    Event,
    Fit,
    Identifiability,
    LadderStep,
    LinearModel,
    Outcome,
    PlannedExperiment,
    Proposal,
    ProposedLaw,
    RankedEffect,
    RecordingComparison,
    Valley,
    Variant,
    WorstCell,
)
from flexgui.sentences.experiments import experiment_sentence, experiment_title
from flexgui.sentences.identifiability import identifiability_sentences, invariant, notes
from flexgui.sentences.ranked import round_sentence
from flexgui.sentences.verdict import STOPPED, all_paragraphs
from flexgui.views.headline import (
    comparisons_as_given,
    criteria,
    final_comparisons,
    final_derived_names,
    final_estimates,
    final_is_biased,
    first_estimates,
    first_is_biased,
    owner_of,
)
from flexgui.views.pooled import (
    ESTIMATE,
    VALIDATE,
    channel_errors,
    derived_names,
    tip_rms,
    with_role,
)
from flexgui.views.summary import alarms, plain

SCHEMA = 1


def result(outcome: Outcome, files: Sequence[str]) -> dict[str, Any]:
    """The content of result.json; `files` are all files of the export.

    `parameters` and `recordings` are of the model as it now stands, after the ladder; those of the
    first fit stand beside them. Without a diagnosis both verdicts and the floors are null and the
    ranking is empty, and the one step is the fit as the comparison shows it. For local fits
    `parameters_as_given` holds the means; each fit's own stand under `fits`.
    """
    diagnosis = outcome.diagnosis
    return {
        "schema": SCHEMA,
        "title": outcome.title,
        "verdict": diagnosis and diagnosis.verdict,
        "final_verdict": diagnosis and diagnosis.final_verdict,
        "ranking": as_record(diagnosis.ranking) if diagnosis else [],
        "parameters": parameters(
            outcome,
            final_estimates(outcome),
            final_derived_names(outcome),
            final_is_biased(outcome),
        ),
        "parameters_as_given": parameters(
            outcome, first_estimates(outcome), derived_names(outcome.fits), first_is_biased(outcome)
        ),
        # What it costs; null where it was not the one identified.
        "linear_model": diagnosis and as_record(diagnosis.linear_model),
        "steps": as_record(diagnosis.steps) if diagnosis else [_as_given(outcome.comparisons)],
        "criteria": criteria(outcome),
        "seconds": {"identify": None, "diagnose": 0.0, **outcome.seconds},
        "method": outcome.method,
        "level": outcome.level,
        "fits": as_record(outcome.fits),
        "recordings": as_record(final_comparisons(outcome)),
        "recordings_as_given": as_record(comparisons_as_given(outcome)),
        "variants": as_record(outcome.variants),
        "diagnosis": diagnosis and _diagnosis(diagnosis, outcome.comparisons),
        "arm": [
            dict(zip(("name", "title", "value", "unit"), row, strict=True))
            for row in outcome.arm_table
        ],
        "repeatability": [asdict(repeated) for repeated in outcome.repeated],
        "notes": (*plain(alarms(outcome)), *notes(outcome)),
        "files": list(files),
    }


def parameters(
    outcome: Outcome, estimates: Sequence[Estimate], derived: frozenset[str], biased: bool
) -> list[dict[str, Any]]:
    """Estimates with their owners, and whether they are derived or biased."""
    return [
        {
            **as_record(e),
            "derived": e.name in derived,
            "of": owner_of(outcome, e.name),
            "biased": biased,
        }
        for e in estimates
    ]


def _as_given(comparisons: Sequence[RecordingComparison]) -> dict[str, Any]:
    """The only ladder step without a diagnosis."""
    estimation = channel_errors(with_role(comparisons, ESTIMATE))
    validation = {e.channel: e for e in channel_errors(with_role(comparisons, VALIDATE))}
    fitted = [e for e in estimation if e.fitted]
    return {
        "added": None,
        "tip_rms_m": tip_rms(with_role(comparisons, ESTIMATE)),
        "fit_percent": [e.fit_percent for e in fitted],
        "validation_fit_percent": [
            validation[e.channel].fit_percent for e in fitted if e.channel in validation
        ],
        "errors": [
            {
                "channel": e.channel,
                "unit": e.unit,
                "rms": e.rms,
                "floor": None,
                "floor_source": None,
                "validation_rms": validation[e.channel].rms if e.channel in validation else None,
                "fitted": e.fitted,
            }
            for e in estimation
        ],
    }


def _diagnosis(diagnosis: Diagnosis, comparisons: Sequence[RecordingComparison]) -> dict[str, Any]:
    """What goes beyond the contract: words, all rounds, worst places, planned experiments."""
    return {
        "words": all_paragraphs(diagnosis),
        "effects": diagnosis.effects,
        "proposed": diagnosis.proposed,
        "shapes": diagnosis.shapes,
        "floors": diagnosis.floors,
        "not_applicable": diagnosis.not_applicable,
        "notes": (STOPPED,) if diagnosis.stopped else (),
        "rounds": as_record(diagnosis.rounds),
        "proposal": as_record(diagnosis.proposal),
        "worst": as_record(error_maps(diagnosis.given or comparisons, diagnosis.floors).worst),
    }


Shape = Mapping[str, str | Callable[[Any], Any]]
"""Name outside -> field, or what makes it of the record."""


def as_record(value: Any) -> Any:
    """A record, or a sequence of records, as plain mappings; other values as they are."""
    if shape := SHAPES.get(type(value)):
        return {
            name: as_record(source(value) if callable(source) else getattr(value, source))
            for name, source in shape.items()
        }
    if isinstance(value, tuple | list):
        return [as_record(each) for each in value]
    return value


def _fields(names: str) -> dict[str, str | Callable[[Any], Any]]:
    """Fields that keep their names, separated by spaces."""
    return {name: name for name in names.split()}


def _parameters(fit: Fit) -> list[dict[str, Any]]:
    derived = derived_names([fit])
    return [{**as_record(e), "derived": e.name in derived} for e in (*fit.estimates, *fit.derived)]


def _identifiability(fit: Fit) -> dict[str, Any]:
    identified = fit.identifiability
    sentences = {"sentences": identifiability_sentences(fit)}
    return {**as_record(identified), **sentences, "valley": as_record(identified.valley)}


SHAPES: Mapping[type, Shape] = {
    Proposal: _fields("reason carriers laws events experiments"),
    Event: _fields("recording start stop target force unit rest"),
    Carrier: _fields("target variable title unit factor share"),
    ProposedLaw: {
        **_fields("title target formula parameters explained"),
        "rms_before": lambda law: law.rms[0],
        "rms_after": lambda law: law.rms[1],
        "unseen_rms_before": lambda law: law.unseen_rms[0],
        "unseen_rms_after": lambda law: law.unseen_rms[1],
        **_fields("delta_bic relative likeness"),
        "over": lambda law: law.carrier.variable,
        "settings": "settings",
    },
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
