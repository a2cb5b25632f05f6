"""What `result.json` says about what is missing."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from core.diagnose.maps import error_maps
from core.results import (
    Diagnosis,
    DiagnosisRound,
    Estimate,
    LadderStep,
    Outcome,
    PlannedExperiment,
    RankedEffect,
    WorstCell,
)

Parameter = Callable[[Estimate], dict[str, Any]]


def verdicts(found: Diagnosis | None, parameter: Parameter) -> dict[str, Any]:
    """The keys that every result has; null and empty where nothing was diagnosed."""
    if found is None:
        return {"verdict": None, "final_verdict": None, "ranking": []}
    return {
        "verdict": found.verdict,
        "final_verdict": found.final_verdict,
        "ranking": [ranked(r, parameter) for r in found.ranking],
    }


def linear_model(found: Diagnosis | None) -> dict[str, Any] | None:
    """What the linear model costs; null where it was not the one identified."""
    if found is None or found.linear_model is None:
        return None
    told = found.linear_model
    return {
        "tip_rms_m": told.tip_rms,
        "full_equations_tip_rms_m": told.full_equations_tip_rms,
    }


def steps(found: Diagnosis, parameter: Parameter) -> list[dict[str, Any]]:
    """The error ladder; the first step is the model as given."""
    return [_step(one, parameter) for one in found.steps]


def diagnosis(outcome: Outcome, parameter: Parameter) -> dict[str, Any] | None:
    """What goes beyond the contract: words, all rounds, worst places, planned experiments."""
    found = outcome.diagnosis
    if found is None:
        return None
    maps = error_maps(found.given or outcome.comparisons, found.floors)
    return {
        "words": found.paragraphs,
        "effects": found.effects,
        "floors": found.floors,
        "not_applicable": found.not_applicable,
        "notes": found.notes,
        "rounds": [_round(one, parameter) for one in found.rounds],
        "worst": [_cell(cell) for cell in maps.worst],
    }


def ranked(one: RankedEffect, parameter: Parameter) -> dict[str, Any]:
    """One candidate."""
    return {
        "effect": one.effect,
        "title": one.title,
        "score": one.score,
        "p_value": one.p_value,
        "expected_drop_percent": one.expected_drop_percent,
        "refit_drop_percent": one.refit_drop_percent,
        "delta_bic": one.delta_bic,
        "confused_with": one.confused_with,
        "parameters": [parameter(e) for e in one.parameters],
    }


def _step(one: LadderStep, parameter: Parameter) -> dict[str, Any]:
    return {
        "added": one.added,
        "title": one.title,
        "parameters": [parameter(e) for e in one.parameters],
        "tip_rms_m": one.tip_rms,
        "fit_percent": one.fit_percent,
        "validation_fit_percent": one.validation_fit_percent,
        "cost_per_sample": one.cost_per_sample,
        "errors": [
            {
                "channel": e.channel,
                "unit": e.unit,
                "rms": e.rms,
                "floor": e.floor,
                "floor_source": e.floor_source or None,
                "validation_rms": e.validation_rms,
            }
            for e in one.errors
        ],
    }


def _round(one: DiagnosisRound, parameter: Parameter) -> dict[str, Any]:
    return {
        "accepted": one.accepted,
        "sentence": one.sentence,
        "ranking": [ranked(r, parameter) for r in one.ranking],
        "next_experiments": [_planned(e) for e in one.experiments],
    }


def _planned(one: PlannedExperiment) -> dict[str, Any]:
    return {
        "title": one.title,
        "simulate": one.simulate,
        "score": one.score,
        "sentence": one.sentence,
    }


def _cell(one: WorstCell) -> dict[str, Any]:
    return {
        "recording": one.recording,
        "channel": one.channel,
        "axis": one.axis,
        "axis_unit": one.axis_unit,
        "low": one.low,
        "high": one.high,
        "rms": one.rms,
        "unit": one.unit,
        "ratio": one.ratio,
    }
