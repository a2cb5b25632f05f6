"""The report's first page, what was found and how sure that is, and its section on what is
missing."""

from __future__ import annotations

import hashlib
import os
import tomllib
from datetime import UTC, datetime
from typing import Any

import numpy as np
from markupsafe import Markup

from flexgui import __version__
from flexgui.core.diagnose.error_maps import error_maps
from flexgui.core.effects import catalogue
from flexgui.core.results import Diagnosis, DiagnosisRound, Outcome, PlannedExperiment
from flexgui.export.template import Plot, plot
from flexgui.sentences.experiments import experiment_title
from flexgui.sentences.ranked import in_order, round_sentence
from flexgui.sentences.verdict import all_paragraphs
from flexgui.sentences.written import format_number
from flexgui.views.error_map import error_map, worst_table
from flexgui.views.fit_table import fit_dots
from flexgui.views.headline import final_comparisons, verdict_now
from flexgui.views.ladder import ladder, ladder_table, sizes_table
from flexgui.views.missing_torque import residual_over
from flexgui.views.of_recording.errors import patterns
from flexgui.views.ranking import ranking, ranking_table
from flexgui.views.summary import doubt
from flexgui.views.table import Column, Row, Table, mathml


def diagnosis_section(outcome: Outcome) -> dict[str, Any] | None:
    """What is missing, as the template shows it; None where nothing was diagnosed."""
    found = outcome.diagnosis
    if found is None:
        return None
    maps = error_maps(found.given or outcome.comparisons, found.floors)
    return {
        "words": all_paragraphs(found),
        "formulas": _formulas(found),
        "ladder_table": ladder_table(found),
        "sizes": sizes_table(found),
        "rounds": [_round(k, one) for k, one in enumerate(found.rounds, start=1)],
        "by_frequency": plot(error_map(maps.by_frequency)),
        "by_time": plot(error_map(maps.by_time, narrow=True)),
        "over": plot(residual_over(patterns(maps))),
        "worst": worst_table(maps.worst),
        "left": _left(found),
        "not_applicable": _not_applicable(found),
    }


def _left(found: Diagnosis) -> Plot | None:
    maps = error_maps(found.left, found.floors) if found.left else None
    return plot(error_map(maps.by_time, narrow=True)) if maps else None


def _formulas(found: Diagnosis) -> tuple[tuple[str, Markup], ...]:
    """Of the effects that were added."""
    known = catalogue()
    kinds = dict.fromkeys(str(entry["id"]) for entry in found.effects)
    shown = [known[kind] for kind in kinds if kind in known and known[kind].formula]
    return tuple((one.title, mathml(one.formula)) for one in shown)


def _round(number: int, one: DiagnosisRound) -> dict[str, Any]:
    """One round's candidates."""
    titles = {r.effect: r.title for r in one.ranking}
    shown = in_order(one.ranking, one.accepted)
    ending = f"{titles.get(one.accepted, '')} was added" if one.accepted else "nothing was added"
    return {
        "title": f"Round {number}: {ending}",
        "sentence": round_sentence(one),
        "figure": plot(ranking(shown, one.accepted)),
        "table": ranking_table(shown, one.accepted),
        "planned": _planned(one.experiments),
    }


def _planned(experiments: tuple[PlannedExperiment, ...]) -> Table | None:
    columns = (Column("Experiment"), Column("Expected score", numeric=True))
    rows = tuple(Row((experiment_title(e), format_number(e.score, 3))) for e in experiments)
    text = (
        "Expected score: increase of the squared error, in squared noise floors, if the wrong "
        "effect is refitted. Above 10 decides."
    )
    return Table(columns, rows, text) if rows else None


def _not_applicable(found: Diagnosis) -> Table | None:
    titles = {kind: effect.title for kind, effect in catalogue().items()}
    rows = tuple(Row((titles.get(kind, kind), why)) for kind, why in found.not_applicable.items())
    return Table((Column("Effect"), Column("Why it was not tried")), rows) if rows else None


DIGITS = 16
"""Of the digest, in hexadecimal: two data sets with the same ones are not met by chance."""

SEED = "identify"
"""The table of a scenario that holds the seed of its search."""


def glance(outcome: Outcome, scenario_text: str) -> dict[str, Any]:
    """All that the first page shows beside the title and the summary."""
    found = outcome.diagnosis
    steps = () if found is None else found.steps
    return {
        "found": "" if found is None else verdict_now(found),
        # In red; empty where the model reaches the noise floor.
        "doubt": doubt(float(np.sqrt(steps[-1].cost_per_sample))) if steps else "",
        "figure": plot(ladder(steps) or fit_dots(final_comparisons(outcome))),
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
    """ISO date; of SOURCE_DATE_EPOCH where a build that is repeated sets it."""
    stated = os.environ.get("SOURCE_DATE_EPOCH", "")
    if stated.isdigit():
        return datetime.fromtimestamp(int(stated), UTC).date().isoformat()
    return datetime.now().astimezone().date().isoformat()


def _seed(scenario_text: str) -> str:
    try:
        stated = tomllib.loads(scenario_text).get(SEED, {}).get("seed")
    except tomllib.TOMLDecodeError:
        stated = None
    return "as by default" if stated is None else str(stated)


def digest(outcome: Outcome) -> str:
    """The first digits of the SHA-256 over names, times and values of all that was measured."""
    whole = hashlib.sha256()
    for recording in outcome.comparisons:
        whole.update(recording.recording.encode())
        for channel in recording.channels:
            whole.update(channel.channel.encode())
            for values in (channel.time, channel.measured):
                whole.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return whole.hexdigest()[:DIGITS]
