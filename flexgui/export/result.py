"""`result.json`: what a script reads (schema 1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from flexgui.core.diagnose.maps import error_maps
from flexgui.core.results import Diagnosis, Estimate, Outcome, RecordingComparison
from flexgui.export.records import as_record
from flexgui.sentences.identifiability import notes
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
    found = outcome.diagnosis
    return {
        "schema": SCHEMA,
        "title": outcome.title,
        "verdict": found and found.verdict,
        "final_verdict": found and found.final_verdict,
        "ranking": as_record(found.ranking) if found else [],
        "parameters": parameters(
            outcome, standing(outcome), follows(outcome), standing_biased(outcome)
        ),
        "parameters_as_given": parameters(
            outcome, given(outcome), derived_names(outcome.fits), given_biased(outcome)
        ),
        # What it costs; null where it was not the one identified.
        "linear_model": found and as_record(found.linear_model),
        "steps": as_record(found.steps) if found else [_as_given(outcome.comparisons)],
        "seconds": {"identify": None, "diagnose": 0.0, **outcome.seconds},
        "method": outcome.method,
        "level": outcome.level,
        "fits": as_record(outcome.fits),
        "recordings": as_record(final_comparisons(outcome)),
        "recordings_as_given": as_record(given_comparisons(outcome)),
        "variants": as_record(outcome.variants),
        "diagnosis": found and _diagnosis(found, outcome.comparisons),
        "arm": [
            dict(zip(("name", "title", "value", "unit"), row, strict=True))
            for row in outcome.arm_table
        ],
        "repeatability": [asdict(one) for one in outcome.repeated],
        "notes": (*plain(alarms(outcome)), *notes(outcome)),
        "files": list(files),
    }


def parameters(
    outcome: Outcome, estimates: Sequence[Estimate], derived: frozenset[str], biased: bool
) -> list[dict[str, Any]]:
    """Estimates with what each belongs to, and whether it follows from others or is biased."""
    return [
        {
            **as_record(e),
            "derived": e.name in derived,
            "of": belongs_to(outcome, e.name),
            "biased": biased,
        }
        for e in estimates
    ]


def _as_given(comparisons: Sequence[RecordingComparison]) -> dict[str, Any]:
    """The only step of the error ladder where nothing was diagnosed."""
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


def _diagnosis(found: Diagnosis, comparisons: Sequence[RecordingComparison]) -> dict[str, Any]:
    """What goes beyond the contract: words, all rounds, worst places, planned experiments."""
    return {
        "words": all_paragraphs(found),
        "effects": found.effects,
        "floors": found.floors,
        "not_applicable": found.not_applicable,
        "notes": (STOPPED,) if found.stopped else (),
        "rounds": as_record(found.rounds),
        "worst": as_record(error_maps(found.given or comparisons, found.floors).worst),
    }
