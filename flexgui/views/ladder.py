"""The error ladder: how the error falls to its floor, effect by effect."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from flexgui.core.results import Diagnosis, LadderStep
from flexgui.sentences.figures import LEFT_BY_ALL, unseen_rms
from flexgui.sentences.written import channel_symbol, estimate_text, format_number, quantity
from flexgui.views import colours
from flexgui.views.headline import COMPLETE
from flexgui.views.layout import Figure, axis, figure
from flexgui.views.names import plain_symbol
from flexgui.views.table import Row, Table, numbers, texts

GIVEN = "as given"

SOURCES = {
    "repetition": "repeated motion",
    "stated": "stated noise",
    "estimated": "the sensor's high frequencies",
}
"""Where a floor's noise comes from, in words."""

MARGIN = 1.6
"""Times the highest bar: the axis ends there, with room for the bar's number."""

BAND = 0.5
"""Times the floor, where the band of the floor ends on the axis."""

LEAST_REDUCTION = 1.1
"""An error that falls by less than this factor gets no arrow: the bars say it."""

LEAVES, ARRIVES = 0.32, 0.72
"""Of the way from one step to the next: beside the bars, where the arrow hides no number."""

LABEL_WIDTH = 12
"""Characters of a line below the bars of a step."""

MANY = 300.0
"""Times the floor, from which the axis names decades only."""


def ladder(steps: Sequence[LadderStep]) -> Figure | None:
    """A pair of bars per step, standing on the floor; None without steps."""
    if not steps:
        return None
    labels = [folded(label) for label in step_labels(steps)]
    errors = {"estimation": [float(np.sqrt(step.cost_per_sample)) for step in steps]}
    errors["validation"] = [unseen_rms(step.errors) for step in steps]
    finite = [v for values in errors.values() for v in values if np.isfinite(v)]
    highest = max(finite, default=1.0)
    bars = [
        _bars(labels, values, role, steps)
        for role, values in errors.items()
        if values is errors["estimation"] or np.isfinite(values).any()
    ]
    text = (
        "Root mean square error over all outputs, each in multiples of its noise floor "
        f"({LEFT_BY_ALL}). In the band, at 1 and below, nothing remains to be explained."
    )
    across = {"type": "rect", "xref": "x domain", "x0": 0, "x1": 1, "y0": BAND, "y1": 1.0}
    floor = {"type": "line", "xref": "x domain", "x0": 0, "x1": 1, "y0": 1.0, "y1": 1.0}
    name = {
        "text": "noise floor", "x": 0.0, "xref": "paper", "xanchor": "left", "xshift": 4,
        "showarrow": False, "y": float(np.log10(np.sqrt(BAND))), "font": {"size": 11},
    }  # fmt: skip
    shown = [np.log10(BAND), np.log10(MARGIN * max(highest, 1.5))]
    return figure(
        bars,
        axis(type="category", automargin=True, tickangle=0, range=[-0.5, len(labels) - 0.5]),
        axis("error [× noise floor]", type="log", range=shown, **_ticks(MARGIN * highest)),
        text, 340, barmode="group", bargap=0.45, bargroupgap=0.08,
        shapes=[
            across | {
                "fillcolor": colours.faded(colours.ADDED, 0.22), "line": {"width": 0},
                "layer": "below",
            },
            floor | {"line": {"color": colours.ADDED, "width": 2}},
        ],
        annotations=[name, *_reductions(errors["estimation"])],
    )  # fmt: skip


def _reductions(errors: Sequence[float]) -> Iterator[Figure]:
    """An arrow from each step to the next where the error falls, with the factor."""
    for k, (before, after) in enumerate(pairwise(errors)):
        if not (np.isfinite(before) and np.isfinite(after) and after * LEAST_REDUCTION < before):
            continue
        times = format_number(before / after, 2, keep_zeros=True)
        begin, end = float(np.log10(before)), float(np.log10(max(after, 1.0)))
        yield {
            "x": k + ARRIVES, "y": end, "ax": k + LEAVES, "ay": begin, "xref": "x", "yref": "y",
            "axref": "x", "ayref": "y", "showarrow": True, "arrowhead": 2, "arrowsize": 1.2,
            "arrowwidth": 2, "arrowcolor": colours.ADDED, "text": "",
        }  # fmt: skip
        yield {
            "x": k + 0.5 * (ARRIVES + LEAVES), "y": 0.5 * (end + begin),
            "text": f"<b>÷ {times}</b>", "showarrow": False, "xanchor": "left", "xshift": 8,
            "yshift": 8, "font": {"size": 14},
        }  # fmt: skip


def _ticks(end: float) -> dict[str, list[float] | list[str]]:
    """1, 2, 5, 10, ... as they are read; decades alone where these would be many."""
    steps = (1, 2, 5) if end < MANY else (1,)
    ticks = [s * 10**k for k in range(int(np.log10(max(end, 1.0))) + 1) for s in steps]
    return {"tickvals": ticks, "ticktext": [f"{tick:g}" for tick in ticks]}


HATCHES = {"estimation": "", "validation": "/"}


def _bars(
    labels: Sequence[str], values: Sequence[float], role: str, steps: Sequence[LadderStep]
) -> Figure:
    name, hatch = f"{role} recordings", HATCHES[role]
    known = [v if np.isfinite(v) else None for v in values]
    return {
        "type": "bar", "name": name, "x": list(labels), "base": 1.0,
        # Noise that is a little smaller than its estimate does not hang below the floor.
        "y": [None if v is None else max(v - 1.0, 0.0) for v in known],
        "marker": {
            "color": colours.faded(colours.RESIDUAL, 0.55) if hatch else colours.RESIDUAL,
            "pattern": {"shape": hatch, "fillmode": "overlay", "fgcolor": colours.RESIDUAL},
        },
        "text": ["" if v is None else f"{format_number(v, 2, keep_zeros=True)} ×" for v in known],
        "textposition": "outside", "cliponaxis": False,
        "customdata": [step.title for step in steps],
        "hovertemplate": f"%{{customdata}}<br>{name}: %{{text}} the noise floor<extra></extra>",
    }  # fmt: skip


def step_labels(steps: Sequence[LadderStep]) -> list[str]:
    """'as given', '+ Coulomb friction', ...; each once."""
    labels: list[str] = []
    for k, step in enumerate(steps):
        text = f"+ {step.title}" if step.added else (GIVEN if not k else step.title)
        same = sum(label.split(" (")[0] == text for label in labels)
        labels.append(f"{text} ({same + 1})" if same else text)
    return labels


def folded(label: str) -> str:
    """In lines of a word or two: level, however many steps stand beside one another."""
    return "<br>".join(textwrap.wrap(label, LABEL_WIDTH, break_long_words=False))


def ladder_table(diagnosis: Diagnosis) -> Table:
    """A row per step and output, in units."""
    columns = (
        *texts("Model", "Output"), *numbers("Rms error", "On validation", "Noise floor"),
        *texts("Noise floor from"), *numbers("Error / noise floor"),
    )  # fmt: skip
    rows = []
    for label, step in zip(step_labels(diagnosis.steps), diagnosis.steps, strict=True):
        for k, e in enumerate(step.errors):
            cells = (
                "" if k else label, channel_symbol(e.channel, e.unit), quantity(e.rms, e.unit),
                quantity(e.validation_rms, e.unit), quantity(e.floor, e.unit),
                SOURCES.get(e.floor_source, e.floor_source),
                format_number(e.rms / e.floor, 3, keep_zeros=True),
            )  # fmt: skip
            rows.append(Row(cells))
        if step.tip_rms is not None:
            rows.append(Row(("", "tip", quantity(step.tip_rms, "m"), "", "", "", ""), strong=True))
    return Table(columns, tuple(rows), "Tip: distance between measured and modelled tip, rms.")


def sizes_table(diagnosis: Diagnosis) -> Table | None:
    """All parameters as they stand after each step; None where no step tells of any."""
    known = {e.name: e for step in diagnosis.steps for e in step.parameters}
    if not known:
        return None
    columns = texts("Model", *(plain_symbol(e.symbol, name) for name, e in known.items()))
    rows = []
    for label, step in zip(step_labels(diagnosis.steps), diagnosis.steps, strict=True):
        mine = {e.name: estimate_text(e) for e in step.parameters}
        rows.append(Row((label, *(mine.get(name, "") for name in known))))
    return Table(columns, tuple(rows), COMPLETE)
