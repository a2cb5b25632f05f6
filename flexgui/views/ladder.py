"""The error ladder: the error after each added effect, down to the noise floor."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from flexgui.core.results import Diagnosis, LadderStep
from flexgui.sentences.figures import FLOOR_IS, validation_rms
from flexgui.sentences.written import channel_symbol, format_number, quantity
from flexgui.views import colours
from flexgui.views.layout import Figure, axis, figure, named_axis
from flexgui.views.table import Row, Table, numbers, texts

GIVEN = "as given"

SOURCES = {
    "repetition": "repeated motion",
    "stated": "stated noise",
    "estimated": "the sensor's high frequencies",
    "column": "what the channel alone shows",
}
"""Where a floor's noise comes from, in words."""

BAND = 0.5
"""Times the floor, where the band of the floor begins on the axis."""

NUMBERS = 0.2
"""Share of the axis right of the longest bar: the bar's number stands there."""

STEP_ROW, AROUND_ROWS = 46, 92
"""px: of one step, and of the legend and the axis together."""

LEAST_REDUCTION = 1.1
"""An error that falls by less than this factor gets no number: the bars say it."""

LABEL_WIDTH = 20
"""Characters of a line beside the bars of a step."""

MANY = 300.0
"""Times the floor, from which the axis names decades only."""

UNSEEN = "no validation"
"""Of a row alone; where all have none, there is no second bar."""
NO_VALIDATION = " There is no recording for validation."


def ladder(
    steps: Sequence[LadderStep], beside: tuple[str, LadderStep] | None = None,
    expected: tuple[str, float] | None = None,
) -> Figure | None:  # fmt: skip
    """A row per step: name, two bars past the noise floor, reduction factor; None without steps.
    On the page a new bar falls from the error before. `beside`: title and step of another model,
    in a row of another colour at the end. `expected`: title and error, in noise floors, of an
    effect that is being fitted, in a pale row."""
    if not steps:
        return None
    labels = [folded(label) for label in step_labels(steps)]
    other, colour = len(steps), [colours.RESIDUAL] * len(steps)
    if expected is not None:
        step = replace(steps[-1], cost_per_sample=expected[1] ** 2, errors=())
        steps, labels = [*steps, step], [*labels, folded(f"+ {expected[0]}, expected")]
        colour.append(colours.faded(colours.RESIDUAL, 0.35))
    if beside is not None:
        steps, labels = [*steps, beside[1]], [*labels, folded(f"beside: {beside[0]}")]
        colour.append(colours.BESIDE)
    estimation = [float(np.sqrt(step.cost_per_sample)) for step in steps]
    validation = [validation_rms(step.errors) for step in steps]
    any_unseen = bool(np.isfinite(validation).any())
    highest = max([v for v in (*estimation, *validation) if np.isfinite(v)], default=1.0)
    low = float(np.log10(BAND))
    length = (float(np.log10(max(highest, 1.5))) - low) / (1.0 - NUMBERS)
    text = (
        f"Overall error: rms over all outputs, each in multiples of its noise floor. {FLOOR_IS} In "
        f"the band (1 and below) nothing is left to explain.{'' if any_unseen else NO_VALIDATION}"
    )
    rows: Figure = {
        "range": [len(steps) - 0.5, -0.5], "showgrid": False, "ticks": "", "automargin": True,
        "fixedrange": True,
    }  # fmt: skip
    factors: Figure = {
        "overlaying": "y", "side": "right", "showline": False, "tickfont": {"size": 19},
    }  # fmt: skip
    height = {"yref": "paper", "y0": 0, "y1": 1}
    drawn = figure(
        [
            _bars(estimation, "estimation", steps, colour),
            *([_bars(validation, "validation", steps, colour)] if any_unseen else []),
            # An axis without anything on it would not be drawn.
            {"type": "scatter", "x": [1.0], "y": [0], "yaxis": "y2", "opacity": 0,
             "showlegend": False, "hoverinfo": "skip"},
        ],
        axis(
            "overall error [× noise floor, shaded]", type="log", range=[low, low + length],
            tickangle=0, automargin=True, **_ticks(10 ** (low + length)),
        ),
        named_axis(labels, **rows),
        text, AROUND_ROWS + STEP_ROW * len(steps), barmode="group", bargap=0.25, bargroupgap=0.1,
        yaxis2=named_axis(reductions(estimation[:other]), **rows, **factors),
        shapes=[
            height | {
                "type": "rect", "x0": BAND, "x1": 1.0, "line": {"width": 0}, "layer": "below",
                "fillcolor": colours.faded(colours.FLOOR, 0.22),
            },
            height | {
                "type": "line", "x0": 1.0, "x1": 1.0, "line": {"color": colours.FLOOR, "width": 2},
            },
        ],
    )  # fmt: skip
    drawn["layout"]["meta"]["morph"] = "x"
    return drawn


def reductions(errors: Sequence[float]) -> list[str]:
    """'<b>÷ 22</b>' at each step that reduced the error; empty elsewhere."""
    texts = [" "]
    for before, after in pairwise(errors):
        reduced = np.isfinite(before) and np.isfinite(after) and after * LEAST_REDUCTION < before
        times = format_number(before / after, 2, keep_zeros=True) if reduced else ""
        texts.append(f"<b>÷ {times}</b>" if reduced else " ")
    return texts


def _ticks(end: float) -> dict[str, list[float] | list[str]]:
    """1, 2, 5, 10, ...; only powers of ten if there would be too many."""
    steps = (1, 2, 5) if end < MANY else (1,)
    ticks = [s * 10**k for k in range(int(np.log10(max(end, 1.0))) + 1) for s in steps]
    return {"tickvals": ticks, "ticktext": [f"{tick:g}" for tick in ticks]}


HATCHES = {"estimation": "", "validation": "/"}


def _bars(
    values: Sequence[float], role: str, steps: Sequence[LadderStep], colour: list[str]
) -> Figure:
    """A bar per step, each of its own colour."""
    finite = [bool(np.isfinite(v)) for v in values]
    return {
        "type": "bar", "orientation": "h", "name": role, "y": list(range(len(values))),
        "base": BAND,  # so that an error at the floor has a bar too
        "x": [max(v - BAND, 0.0) if k else 0.0 for v, k in zip(values, finite, strict=True)],
        "marker": {
            "color": colour,
            # "overlay" asks for a contrast to the colour, which Plotly refuses to find for a list.
            "pattern": {"shape": HATCHES[role], "fillmode": "replace"},
            "line": {"width": 1, "color": colour},  # or Plotly draws none of no length
        },
        "text": [
            f"{format_number(v, 2, keep_zeros=True)} ×" if k else UNSEEN if step.errors else ""
            for v, k, step in zip(values, finite, steps, strict=True)
        ],
        "textposition": "outside", "textangle": 0, "cliponaxis": False,
        "customdata": [step.title for step in steps],
        "hovertemplate": f"%{{customdata}}<br>{role}: %{{text}} noise floor<extra></extra>",
    }  # fmt: skip


def step_labels(steps: Sequence[LadderStep]) -> list[str]:
    """'as given', '+ Coulomb friction', ...; each label is unique."""
    labels: list[str] = []
    for k, step in enumerate(steps):
        text = f"+ {step.title}" if step.added else (GIVEN if not k else step.title)
        same = sum(label.split(" (")[0] == text for label in labels)
        labels.append(f"{text} ({same + 1})" if same else text)
    return labels


def folded(label: str) -> str:
    """The text in short lines, to leave space for the bars."""
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
    return Table(columns, tuple(rows), "Tip: rms distance between measured and modelled tip.")
