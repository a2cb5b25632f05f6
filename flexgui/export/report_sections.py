"""The report's first page and its section on missing effects."""

from __future__ import annotations

import hashlib
import os
import tomllib
from datetime import UTC, datetime
from typing import Any

import numpy as np
from markupsafe import Markup

from flexgui import __version__
from flexgui.core.effects import catalogue
from flexgui.core.error_maps import error_maps
from flexgui.core.results import Diagnosis, DiagnosisRound, Outcome, PlannedExperiment, Proposal
from flexgui.core.scenario.read import document_toml
from flexgui.sentences.experiments import experiment_title
from flexgui.sentences.ranked import in_order, round_sentence
from flexgui.sentences.verdict import all_paragraphs
from flexgui.sentences.written import format_number
from flexgui.views.error_map import error_map, worst_table
from flexgui.views.fit_table import fit_dots
from flexgui.views.headline import current_verdict, final_comparisons
from flexgui.views.ladder import ladder, ladder_table
from flexgui.views.layout import Figure
from flexgui.views.missing_torque import residual_over
from flexgui.views.of_recording.errors import patterns
from flexgui.views.proposal import carrier_shares, law_over_variable, laws_table
from flexgui.views.ranking import ranking, ranking_table
from flexgui.views.summary import provisional_warning
from flexgui.views.table import PAPER, Column, Row, Table, mathml_lines


def diagnosis_section(outcome: Outcome) -> dict[str, Any] | None:
    """Data of the section on missing effects; None without a diagnosis."""
    diagnosis = outcome.diagnosis
    if diagnosis is None:
        return None
    maps = error_maps(diagnosis.given or outcome.comparisons, diagnosis.floors)
    return {
        "words": all_paragraphs(diagnosis),
        "formulas": _formulas(diagnosis),
        "ladder_table": ladder_table(diagnosis),
        "rounds": [_round(k, searched) for k, searched in enumerate(diagnosis.rounds, start=1)],
        "proposal": _proposal(diagnosis.proposal),
        "by_frequency": error_map(maps.by_frequency),
        "by_time": error_map(maps.by_time, narrow=True),
        "over": residual_over(patterns(maps)),
        "worst": worst_table(maps.worst),
        "left": _residual_plot(diagnosis),
        "not_applicable": _not_applicable(diagnosis),
    }


def _proposal(proposal: Proposal | None) -> dict[str, Any] | None:
    """What the rest depends on, and the laws; None where none were looked for, or an event is."""
    if proposal is None or not proposal.carriers or proposal.events:
        return None
    return {
        "shares": carrier_shares(proposal),
        "laws": [law_over_variable(t.carrier, t) for law in proposal.laws for t in law.terms]
        or [law_over_variable(proposal.carriers[0])],
        "formulas": [(law.title, mathml_lines(law.latex, PAPER)) for law in proposal.laws],
        "table": laws_table(proposal),
        "planned": _planned(proposal.experiments),
        "settings": "\n".join(document_toml({"model": {"own": [law.settings]}})
                              for law in proposal.laws[:1]),
    }  # fmt: skip


def _residual_plot(diagnosis: Diagnosis) -> Figure | None:
    maps = error_maps(diagnosis.left, diagnosis.floors) if diagnosis.left else None
    return error_map(maps.by_time, narrow=True) if maps else None


def _formulas(diagnosis: Diagnosis) -> tuple[tuple[str, Markup], ...]:
    """Formulas of the added effects."""
    effects = catalogue()
    kinds = dict.fromkeys(str(entry["id"]) for entry in diagnosis.effects)
    shown = [effects[kind] for kind in kinds if kind in effects and effects[kind].formula]
    return tuple((effect.title, mathml_lines(effect.formula, PAPER)) for effect in shown)


def _round(number: int, searched: DiagnosisRound) -> dict[str, Any]:
    """The candidates of one round."""
    titles = {r.effect: r.title for r in searched.ranking}
    shown = in_order(searched.ranking, searched.accepted)
    accepted = searched.accepted
    ending = f"{titles.get(accepted, '')} was added" if accepted else "nothing was added"
    return {
        "title": f"Round {number}: {ending}",
        "sentence": round_sentence(searched),
        "figure": ranking(shown, searched.accepted),
        "table": ranking_table(shown, searched.accepted),
        "planned": _planned(searched.experiments),
    }


def _planned(experiments: tuple[PlannedExperiment, ...]) -> Table | None:
    columns = (Column("Experiment"), Column("Expected score", numeric=True))
    rows = tuple(Row((experiment_title(e), format_number(e.score, 3))) for e in experiments)
    text = (
        "Expected score: increase of the squared error, in squared noise floors, if the wrong "
        "effect is refitted. Above 10 decides."
    )
    return Table(columns, rows, text) if rows else None


def _not_applicable(diagnosis: Diagnosis) -> Table | None:
    titles = {kind: effect.title for kind, effect in catalogue().items()}
    rows = tuple(Row((titles.get(k, k), why)) for k, why in diagnosis.not_applicable.items())
    return Table((Column("Effect"), Column("Why it was not tried")), rows) if rows else None


DIGITS = 16
"""Of the digest, in hexadecimal: two data sets with the same ones are not met by chance."""

SEED_TABLE = "identify"
"""The table of a scenario that holds the seed of its search."""


def glance(outcome: Outcome, scenario_text: str) -> dict[str, Any]:
    """Data of the first page besides title and summary."""
    diagnosis = outcome.diagnosis
    steps = () if diagnosis is None else diagnosis.steps
    return {
        "found": "" if diagnosis is None else current_verdict(diagnosis),
        # In red; empty where the model reaches the noise floor.
        "doubt": provisional_warning(float(np.sqrt(steps[-1].cost_per_sample))) if steps else "",
        "figure": ladder(steps) or fit_dots(final_comparisons(outcome)),
        "facts": _facts(outcome, scenario_text),
    }


def _facts(outcome: Outcome, scenario_text: str) -> tuple[tuple[str, str], ...]:
    count = len(outcome.comparisons)
    return (
        ("Date", _today()),
        ("Version", f"FlexGUI {__version__}"),
        ("Seed", _seed(scenario_text)),
        ("Data", f"{count} recordings, SHA-256 {digest(outcome)}"),
    )


def _today() -> str:
    """ISO date; from SOURCE_DATE_EPOCH for a reproducible build."""
    stated = os.environ.get("SOURCE_DATE_EPOCH", "")
    if stated.isdigit():
        return datetime.fromtimestamp(int(stated), UTC).date().isoformat()
    return datetime.now().astimezone().date().isoformat()


def _seed(scenario_text: str) -> str:
    try:
        stated = tomllib.loads(scenario_text).get(SEED_TABLE, {}).get("seed")
    except tomllib.TOMLDecodeError:
        stated = None
    return "as by default" if stated is None else str(stated)


def digest(outcome: Outcome) -> str:
    """First digits of the SHA-256 over names, times and values of all measurements."""
    whole = hashlib.sha256()
    for recording in outcome.comparisons:
        whole.update(recording.recording.encode())
        for channel in recording.channels:
            whole.update(channel.channel.encode())
            for values in (channel.time, channel.measured):
                whole.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return whole.hexdigest()[:DIGITS]
