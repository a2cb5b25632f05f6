"""The report's first page: what was found, how sure that is, one figure, and what it is of."""

from __future__ import annotations

import hashlib
import os
import tomllib
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from core.results import Outcome
from flexgui import __version__
from flexgui.export.plot import Plot, plot
from flexgui.views.fit_table import fit_bars
from flexgui.views.headline import final_comparisons
from flexgui.views.ladder import ladder
from flexgui.views.summary import doubt

DIGITS = 16
"""Of the digest, in hexadecimal: two data sets with the same ones are not met by chance."""

SEED = "identify"
"""The table of a scenario that holds the seed of its search."""


@dataclass(frozen=True)
class Glance:
    """Everything that the first page shows beside the title and the summary."""

    found: str
    doubt: str
    """In red; empty where the model reaches the noise floor."""
    figure: Plot | None
    facts: tuple[tuple[str, str], ...]


def glance(outcome: Outcome, scenario_text: str) -> Glance:
    """Of a whole result."""
    found = outcome.diagnosis
    steps = () if found is None else found.steps
    shown = ladder(steps) or fit_bars(final_comparisons(outcome))
    return Glance(
        found="" if found is None or not found.words else found.words[0],
        doubt=doubt(float(np.sqrt(steps[-1].cost_per_sample))) if steps else "",
        figure=plot(shown),
        facts=_facts(outcome, scenario_text),
    )


def has_ladder(outcome: Outcome) -> bool:
    """Whether the figure of the first page is the error ladder."""
    return outcome.diagnosis is not None and bool(outcome.diagnosis.steps)


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
