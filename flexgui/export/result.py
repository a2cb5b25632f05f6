"""`result.json`: what a script reads (schema 1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from flexgui.core.diagnose.maps import error_maps
from flexgui.core.results import (
    Diagnosis,
    DiagnosisRound,
    Estimate,
    Fit,
    LadderStep,
    Outcome,
    RankedEffect,
    RecordingComparison,
    Variant,
)
from flexgui.export.tables import fields_of
from flexgui.sentences.experiments import experiment_sentence, experiment_title
from flexgui.sentences.identifiability import identifiability_sentences, invariant
from flexgui.sentences.notes import notes
from flexgui.sentences.ranked import round_sentence
from flexgui.sentences.verdict import STOPPED, all_paragraphs
from flexgui.views.headline import (
    belongs_to,
    final_comparisons,
    follows,
    given,
    given_biased,
    given_comparisons,
    standing,
    standing_biased,
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
    return {
        "schema": SCHEMA,
        "title": outcome.title,
        **_verdicts(outcome.diagnosis),
        "parameters": _parameters(
            outcome, standing(outcome), follows(outcome), standing_biased(outcome)
        ),
        "parameters_as_given": _parameters(
            outcome, given(outcome), derived_names(outcome.fits), given_biased(outcome)
        ),
        "linear_model": _linear_model(outcome.diagnosis),
        "steps": _steps(outcome),
        "seconds": {"identify": None, "diagnose": 0.0, **outcome.seconds},
        "method": outcome.method,
        "level": outcome.level,
        "fits": [_fit(fit) for fit in outcome.fits],
        "recordings": [_recording(c) for c in final_comparisons(outcome)],
        "recordings_as_given": [_recording(c) for c in given_comparisons(outcome)],
        "variants": [_variant(variant) for variant in outcome.variants],
        "diagnosis": _diagnosis(outcome),
        "arm": [
            {"name": name, "title": title, "value": value, "unit": unit}
            for name, title, value, unit in outcome.arm_table
        ],
        "repeatability": [asdict(one) for one in outcome.repeated],
        "notes": (*plain(alarms(outcome)), *notes(outcome)),
        "files": list(files),
    }


def _verdicts(found: Diagnosis | None) -> dict[str, Any]:
    """The keys that every result has; null and empty where nothing was diagnosed."""
    if found is None:
        return {"verdict": None, "final_verdict": None, "ranking": []}
    return {
        **fields_of(found, "verdict final_verdict"),
        "ranking": [_ranked(r) for r in found.ranking],
    }


def _linear_model(found: Diagnosis | None) -> dict[str, Any] | None:
    """What the linear model costs; null where it was not the one identified."""
    if found is None or found.linear_model is None:
        return None
    linear = found.linear_model
    return {
        "tip_rms_m": linear.tip_rms,
        "full_equations_tip_rms_m": linear.full_equations_tip_rms,
    }


def _steps(outcome: Outcome) -> list[dict[str, Any]]:
    """The error ladder; the first step is the model as given."""
    if outcome.diagnosis is not None:
        return [_ladder_step(one) for one in outcome.diagnosis.steps]
    return [{"added": None, **_step(outcome.comparisons)}]


def _step(comparisons: Sequence[RecordingComparison]) -> dict[str, Any]:
    estimation = channel_errors(with_role(comparisons, ESTIMATE))
    validation = {e.channel: e for e in channel_errors(with_role(comparisons, VALIDATE))}
    fitted = [e for e in estimation if e.fitted]
    return {
        "tip_rms_m": tip_rms(with_role(comparisons, ESTIMATE)),
        "fit_percent": [e.fit_percent for e in fitted],
        "validation_fit_percent": [
            validation[e.channel].fit_percent for e in fitted if e.channel in validation
        ],
        "errors": [
            {
                **fields_of(e, "channel unit rms"),
                "floor": None,
                "floor_source": None,
                "validation_rms": validation[e.channel].rms if e.channel in validation else None,
                "fitted": e.fitted,
            }
            for e in estimation
        ],
    }


def _ladder_step(one: LadderStep) -> dict[str, Any]:
    return {
        **fields_of(one, "added title"),
        "parameters": [_parameter(e) for e in one.parameters],
        "tip_rms_m": one.tip_rms,
        **fields_of(one, "fit_percent validation_fit_percent cost_per_sample"),
        "errors": [
            {
                **fields_of(e, "channel unit rms floor"),
                "floor_source": e.floor_source or None,
                "validation_rms": e.validation_rms,
            }
            for e in one.errors
        ],
    }


def _parameters(
    outcome: Outcome, estimates: Sequence[Estimate], derived: frozenset[str], biased: bool
) -> list[dict[str, Any]]:
    return [
        {**_parameter(e, derived), "of": belongs_to(outcome, e.name), "biased": biased}
        for e in estimates
    ]


def _parameter(estimate: Estimate, derived: frozenset[str] = frozenset()) -> dict[str, Any]:
    names = "name value std unit identifiable symbol start lower upper at_bound recording"
    return {**fields_of(estimate, names), "derived": estimate.name in derived}


def _fit(fit: Fit) -> dict[str, Any]:
    derived, found = derived_names([fit]), fit.identifiability
    valley = found.valley
    return {
        **fields_of(fit, "label recordings"),
        "parameters": [_parameter(e, derived) for e in (*fit.estimates, *fit.derived)],
        **fields_of(fit, "correlation cost residual_count"),
        "generations": len(fit.convergence),
        **fields_of(fit, "gradient_norm message stopped"),
        "identifiability": {
            **fields_of(found, "names rank singular_values null_directions"),
            "sentences": identifiability_sentences(fit),
            "valley": valley
            and {
                **fields_of(valley, "names units points cost_ratio"),
                "invariant": invariant(valley),
            },
        },
    }


def _recording(comparison: RecordingComparison) -> dict[str, Any]:
    return {
        "name": comparison.recording,
        "role": comparison.role,
        "fit": comparison.fit_label,
        "tip_rms_m": comparison.tip_rms,
        "note": comparison.note,
        "channels": [
            {
                **fields_of(channel, "channel unit fitted"),
                "samples": int(channel.counted.sum()),
                **fields_of(channel, "fit_percent rms normalised_error relative_error"),
            }
            for channel in comparison.channels
        ],
    }


def _variant(variant: Variant) -> dict[str, Any]:
    return {
        "title": variant.title,
        "parameters": [_parameter(estimate) for estimate in variant.estimates],
        "recordings": [_recording(comparison) for comparison in variant.comparisons],
    }


def _diagnosis(outcome: Outcome) -> dict[str, Any] | None:
    """What goes beyond the contract: words, all rounds, worst places, planned experiments."""
    found = outcome.diagnosis
    if found is None:
        return None
    maps = error_maps(found.given or outcome.comparisons, found.floors)
    return {
        "words": all_paragraphs(found),
        "effects": found.effects,
        "floors": found.floors,
        "not_applicable": found.not_applicable,
        "notes": (STOPPED,) if found.stopped else (),
        "rounds": [_round(one) for one in found.rounds],
        "worst": [fields_of(c, "recording channel axis axis_unit low high rms unit ratio")
                  for c in maps.worst],
    }  # fmt: skip


def _ranked(one: RankedEffect) -> dict[str, Any]:
    return {
        "effect": one.effect,
        "title": one.title,
        **fields_of(one, "score p_value expected_drop_percent refit_drop_percent delta_bic"),
        "confused_with": one.confused_with,
        "tied_to": [e.name for e in one.tied_to],
        "parameters": [_parameter(e) for e in one.parameters],
    }


def _round(one: DiagnosisRound) -> dict[str, Any]:
    return {
        "accepted": one.accepted,
        "sentence": round_sentence(one),
        "ranking": [_ranked(r) for r in one.ranking],
        "next_experiments": [
            {
                "title": experiment_title(e),
                **fields_of(e, "simulate score"),
                "sentence": experiment_sentence(e),
            }
            for e in one.experiments
        ],
    }
