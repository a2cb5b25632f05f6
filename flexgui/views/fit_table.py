"""How well models reproduce each output of each recording, as tables and as bars."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from flexgui.core.results import ChannelComparison, Outcome, RecordingComparison
from flexgui.sentences.written import channel_symbol, format_number, quantity
from flexgui.views.colours import channel_colour, channel_edge
from flexgui.views.layout import Figure, axis, figure, headline
from flexgui.views.names import format_percent
from flexgui.views.pooled import (
    ESTIMATE,
    VALIDATE,
    ChannelError,
    channel_errors,
    mean,
    tip_rms,
    with_role,
)
from flexgui.views.table import Row, Table, numbers, texts

FIT_IS = "FIT is 100 % for a perfect match and 0 % for a model no better than a constant."
ROLES = {ESTIMATE: "estimation", VALIDATE: "validation"}

OF_ROW = texts("Recording", "Role", "Output")
COLUMNS = (
    *OF_ROW, *numbers("FIT [%]", "Rms error", "‖r‖ / ‖y − mean‖ [–]", "‖r‖ / ‖y‖ [–]")
)  # fmt: skip
Error = ChannelComparison | ChannelError
"""Of one recording, or of all of a role."""
GIVEN_COLUMNS = numbers("FIT as given [%]", "Rms as given")


def fit_table(
    comparisons: Sequence[RecordingComparison], before: Sequence[RecordingComparison] = ()
) -> Table:
    """The means over the recordings of each role, then a row per recording and output; `before`:
    the same of the model as given, in columns of their own."""
    rows: list[Row] = []

    def add(label: str, role: str, of: Error, ratios: Iterable[str], was: Error | None) -> None:
        symbol = channel_symbol(of.channel, of.unit) + ("" if of.fitted else " *")
        known = (label, ROLES.get(role, role), symbol, *_quality(of), *ratios)
        cells = (*known, *_quality(was)) if before else known
        rows.append(Row(cells, strong=isinstance(of, ChannelError)))

    for role in (ESTIMATE, VALIDATE):
        chosen = with_role(comparisons, role)
        earlier = {e.channel: e for e in channel_errors(with_role(before, role))}
        for error in channel_errors(chosen) if len(chosen) > 1 else ():
            add(f"all {len(chosen)}", role, error, ("", ""), earlier.get(error.channel))
    given = {(r.recording, c.channel): c for r in before for c in r.channels}
    for recording in comparisons:
        for c in recording.channels:
            ratios = (c.normalised_error, c.relative_error)
            figures = (format_number(x, 3, keep_zeros=True) for x in ratios)
            was = given.get((recording.recording, c.channel))
            add(bar_label(recording, comparisons), recording.role, c, figures, was)
    columns = (*COLUMNS, *GIVEN_COLUMNS) if before else COLUMNS
    return Table(
        columns,
        tuple(rows),
        "r: measured minus model. y: measured. An output marked * was not fitted. "
        "FIT = 100 (1 − ‖r‖ / ‖y − mean‖), not below 0. "
        "In the rows of all recordings FIT is a mean and the rms error counts all samples alike.",
    )


def _quality(of: Error | None) -> tuple[str, str]:
    """FIT and rms error."""
    return ("", "") if of is None else (format_percent(of.fit_percent), quantity(of.rms, of.unit))


def overview(
    comparisons: Sequence[RecordingComparison], before: Sequence[RecordingComparison] = ()
) -> Table | None:
    """A row per fitted output and one for the tip, over all recordings of each role; `before` as
    in `fit_table`. None where nothing was compared."""
    heads, columns = [*texts("Output")], list[dict[str, str]]()
    for role in (ESTIMATE, VALIDATE):
        for title, chosen in (("", comparisons), (" as given", before)):
            if with_role(chosen, role):
                heads += numbers(*(f"{what}, {ROLES[role]}{title}" for what in ("FIT [%]", "Rms")))
                columns += _pooled(with_role(chosen, role))
    names = list(dict.fromkeys(name for column in columns for name in column))
    rows = tuple(Row((n, *(column.get(n, "") for column in columns))) for n in names)
    return Table(tuple(heads), rows, FIT_IS) if rows else None


def _pooled(chosen: Sequence[RecordingComparison]) -> tuple[dict[str, str], dict[str, str]]:
    """Output -> its FIT, and output or tip -> its rms error."""
    fitted = [e for e in channel_errors(chosen) if e.fitted]
    found = {channel_symbol(e.channel, e.unit): _quality(e) for e in fitted}
    errors = {symbol: rms for symbol, (_, rms) in found.items()}
    distance = tip_rms(chosen)
    if distance is not None and np.isfinite(distance):
        errors["tip"] = quantity(distance, "m")
    return {symbol: fit for symbol, (fit, _) in found.items()}, errors


def variants(outcome: Outcome) -> Table | None:
    """The normalised error per recording and output, a column per model; None without others.

    The outputs are those that the scenario's own model was fitted to.
    """
    if not outcome.variants:
        return None
    errors = [
        {
            (bar_label(r, comparisons), r.role, c.channel): c.normalised_error
            for r in comparisons
            for c in r.channels
            if c.fitted
        }
        for comparisons in (outcome.comparisons, *(v.comparisons for v in outcome.variants))
    ]
    keys = list(errors[0]) or list(dict.fromkeys(key for e in errors for key in e))
    groups: dict[tuple[str, str], list[tuple[str, str, str]]] = {}
    for key in keys:
        groups.setdefault(key[1:], []).append(key)
    several = {(f"all {len(g)}", *kind): g for kind, g in groups.items() if len(g) > 1}
    rows = []
    for (label, role, channel), group in (*several.items(), *((key, [key]) for key in keys)):
        values = [mean([e.get(key, float("nan")) for key in group]) for e in errors]
        heads = (label, ROLES.get(role, role), channel_symbol(channel))
        best = len(heads) + int(np.nanargmin(values)) if np.isfinite(values).any() else None
        figures = (format_number(value, 3, keep_zeros=True) for value in values)
        rows.append(Row((*heads, *figures), strong=len(group) > 1, best=best))
    return Table(
        (*OF_ROW, *numbers("this model", *(variant.title for variant in outcome.variants))),
        tuple(rows),
        "Normalised error ‖measured − model‖ / ‖measured − its mean‖, no unit; the least of each "
        "row is coloured. Rows of all recordings hold the mean.",
    )


def fit_bars(comparisons: Sequence[RecordingComparison]) -> Figure | None:
    """What each FIT leaves to 100 %: one group of bars per recording, one bar per fitted output;
    None without a FIT. On a logarithmic axis good models differ too."""
    text = "‖measured − model‖ / ‖measured − its mean‖, in per cent: 100 % minus the FIT."
    if any(r.role == VALIDATE for r in comparisons):
        text += " Hatched: recordings that no fit has seen."
    return _bars(
        comparisons, lambda c: 100.0 * c.normalised_error, "%{x}: %{y:.3g} %",
        axis("recording", type="category", automargin=True),
        axis("error [% of the motion]", type="log", dtick="D2"), caption=text, height=360,
    )  # fmt: skip


AXIS_END = 118.0
"""%, of the axis: above a bar that is full its output is written."""


def live_fit(comparisons: Sequence[RecordingComparison]) -> Figure | None:
    """The FIT itself, each bar with the name of its output; None where nothing has a FIT."""
    drawn = _bars(
        comparisons, lambda c: round(c.fit_percent, 3), "%{x}: %{y:.2f} %<extra></extra>",
        axis(type="category", tickangle=0 if len(comparisons) < 10 else 45),
        axis("FIT [%]", range=[0.0, AXIS_END], tickvals=[0, 50, 100]),
        title=headline("FIT (hatched: validation)"),
    )  # fmt: skip
    for bar in drawn["data"] if drawn else ():
        bar |= {"x": [label.removeprefix("θ2 = ") for label in bar["x"]]}
        bar |= {"text": [bar["name"]] * len(bar["x"]), "textposition": "outside"}
        bar |= {"textangle": 0, "cliponaxis": False}
    return drawn


def _bars(
    comparisons: Sequence[RecordingComparison], size: Callable[[ChannelComparison], float],
    hover: str, x: Figure, y: Figure, **layout: Any,
) -> Figure | None:  # fmt: skip
    fitted = [(r, c) for r in comparisons for c in r.channels if c.fitted]
    known = dict.fromkeys(c.channel for _, c in fitted if np.isfinite(c.fit_percent))
    traces = []
    for name in known:
        bars = [(r, c) for r, c in fitted if c.channel == name]
        hatch = ["/" if r.role == VALIDATE else "" for r, _ in bars]
        sizes = [size(c) for _, c in bars]
        traces.append(
            {
                "type": "bar", "name": channel_symbol(name, bars[0][1].unit),
                "x": [bar_label(r, comparisons) for r, _ in bars],
                "y": [value if np.isfinite(value) else None for value in sizes],
                "marker": {
                    "color": channel_colour(name),
                    "line": {"color": channel_edge(name), "width": 1},
                    "pattern": {"shape": hatch, "fillmode": "overlay"},
                },
                "hovertemplate": hover,
            }
        )  # fmt: skip
    return figure(traces, x, y, barmode="group", bargap=0.25, **layout) if traces else None


def bar_label(recording: RecordingComparison, among: Sequence[RecordingComparison]) -> str:
    """The recording's name, with the fit where one recording is compared with several."""
    same = [r for r in among if r.recording == recording.recording]
    if len(same) == 1:
        return recording.recording
    return f"{recording.recording} ({recording.fit_label})"
