"""How well models reproduce each output of each recording, as tables and as dots."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from flexgui.core.results import ChannelComparison, Outcome, RecordingComparison
from flexgui.sentences.written import channel_symbol, format_number, quantity
from flexgui.views import colours
from flexgui.views.layout import Figure, Pane, axis, dots, named_axis, panes
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

FIT_IS = "FIT: 100 % is a perfect match, 0 % is no better than a constant."
ROLES = {ESTIMATE: "estimation", VALIDATE: "validation"}

OF_ROW = texts("Recording", "Role", "Output")
FIT_COLUMNS = (
    *OF_ROW, *numbers("FIT [%]", "Rms error", "‖r‖ / ‖y − mean‖ [–]", "‖r‖ / ‖y‖ [–]")
)  # fmt: skip
Error = ChannelComparison | ChannelError
"""Of one recording, or of all of a role."""
GIVEN_COLUMNS = numbers("FIT as given [%]", "Rms as given")


def fit_table(
    comparisons: Sequence[RecordingComparison], before: Sequence[RecordingComparison] = ()
) -> Table:
    """Means per role, then a row per recording and output; `before`: of the model as given."""
    rows: list[Row] = []

    def add(label: str, role: str, of: Error, ratios: Iterable[str], was: Error | None) -> None:
        symbol = channel_symbol(of.channel, of.unit) + ("" if of.fitted else " *")
        cells_now = (label, ROLES.get(role, role), symbol, *_quality(of), *ratios)
        cells = (*cells_now, *_quality(was)) if before else cells_now
        rows.append(Row(cells, strong=isinstance(of, ChannelError)))

    for role in (ESTIMATE, VALIDATE):
        chosen = with_role(comparisons, role)
        earlier = {e.channel: e for e in channel_errors(with_role(before, role))}
        for error in channel_errors(chosen) if len(chosen) > 1 else ():
            add(f"all {len(chosen)}", role, error, ("", ""), earlier.get(error.channel))
    as_given = {(r.recording, c.channel): c for r in before for c in r.channels}
    for recording in comparisons:
        for c in recording.channels:
            ratios = (c.normalised_error, c.relative_error)
            figures = (format_number(x, 3, keep_zeros=True) for x in ratios)
            was = as_given.get((recording.recording, c.channel))
            add(bar_label(recording, comparisons), recording.role, c, figures, was)
    columns = (*FIT_COLUMNS, *GIVEN_COLUMNS) if before else FIT_COLUMNS
    return Table(
        columns,
        tuple(rows),
        "r: measured minus model. y: measured. An output marked * was not fitted. "
        "FIT = 100 (1 − ‖r‖ / ‖y − mean‖), not below 0. "
        "In rows of all recordings FIT is the mean, and the rms error is over all samples.",
    )


def _quality(of: Error | None) -> tuple[str, str]:
    """FIT and rms error as text."""
    return ("", "") if of is None else (format_percent(of.fit_percent), quantity(of.rms, of.unit))


def overview(
    comparisons: Sequence[RecordingComparison], before: Sequence[RecordingComparison] = ()
) -> Table | None:
    """A row per fitted output and for the tip, per role; None if nothing was compared."""
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
    qualities = {channel_symbol(e.channel, e.unit): _quality(e) for e in fitted}
    errors = {symbol: rms for symbol, (_, rms) in qualities.items()}
    distance = tip_rms(chosen)
    if distance is not None and np.isfinite(distance):
        errors["tip"] = quantity(distance, "m")
    return {symbol: fit for symbol, (fit, _) in qualities.items()}, errors


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
        "Normalised error ‖measured − model‖ / ‖measured − its mean‖, no unit. The smallest of "
        "each row is coloured. Rows of all recordings hold the mean.",
    )


LEAST_MISFIT, LARGEST_MISFIT = 0.01, 100.0
"""100 % − FIT: the axis has equal steps from 0 to 90, 99, 99.9, …"""
NUMBERED = (0.0, 50.0, 80.0, 90.0, 95.0, 98.0, 99.0, 99.5, 99.9, 99.99)
"""%, the FITs at which an axis may begin and end."""
DOTS = 0.6
"""Of an axis, for the dots; right of them there is room for their numbers."""
TICK_GAP = 0.35
"""Of the dots' part of an axis, between two of its numbers."""
MOST_BESIDE = 3
"""Outputs side by side: the axes of more have no room for their numbers."""
THE_AXIS = "FIT, in equal steps 0, 90, 99, 99.9 [%]"
LOOK = {
    ESTIMATE: {"symbol": "circle", "size": 8},
    VALIDATE: {"symbol": "diamond-open", "size": 9, "line": {"width": 2}},
}
HEIGHT_OF_FRAME, HEIGHT_PER_ROW, HEIGHT_BELOW = 84, 20, 48


def fit_dots(comparisons: Sequence[RecordingComparison]) -> Figure | None:
    """FIT as dots and numbers: rows are recordings, columns fitted outputs; None without FIT."""
    fits = [
        (bar_label(r, comparisons), r.role, c)
        for r in comparisons
        for c in r.channels
        if c.fitted and np.isfinite(c.fit_percent)
    ]
    if not fits:
        return None
    rows, parts = list(dict.fromkeys(label for label, _, _ in fits)), list[Pane]()
    ends = _ends([c.fit_percent for _, _, c in fits])
    x = _fit_axis(*ends)
    names = list(dict.fromkeys(c.channel for _, _, c in fits))
    columns = len(names) if len(names) <= MOST_BESIDE else min(-(-len(names) // 2), MOST_BESIDE)
    for k, name in enumerate(names):
        of = [(rows.index(label), role, c) for label, role, c in fits if c.channel == name]
        traces = [_fit_numbers([(row, c.fit_percent) for row, _, c in of], 10.0 ** x["range"][1])]
        for role in LOOK:
            chosen = [(row, c.fit_percent) for row, found, c in of if found == role]
            traces.append(_fit_marks(chosen, role))
        y = named_axis(rows, range=[len(rows) - 0.5, -0.5], automargin=True)
        y |= {"showticklabels": k % columns == 0}
        parts.append(Pane(traces, y, x, title=channel_symbol(name, of[0][2].unit)))
    lines = -(-len(parts) // columns)
    middle = (lines - 1) * columns + (columns - 1) // 2
    parts[middle] = parts[middle]._replace(
        x=x | {"title": axis(THE_AXIS)["title"] | {"font": {"size": 12}}}
    )
    inside = lines * HEIGHT_PER_ROW * len(rows) + (lines - 1) * HEIGHT_BELOW
    drawn = panes(
        parts, None, f"{THE_AXIS}.", HEIGHT_OF_FRAME + inside, 0.03, columns, HEIGHT_BELOW / inside
    )
    # Above the outputs' names.
    drawn["layout"]["legend"] |= {"yref": "container", "y": 1.0, "yanchor": "top"}
    return drawn


def _fit_axis(lowest: float, highest: float) -> Figure:
    """Of 100 − FIT, from a `lowest` to a `highest` FIT in %, with room for numbers behind."""
    first, last = np.log10(100.0 - np.array([lowest, highest]))
    least = TICK_GAP * (first - last)
    ticks = [lowest]
    for tick in (n for n in NUMBERED if lowest < n < highest):
        before, place = np.log10(100.0 - np.array([ticks[-1], tick]))
        if before - place >= least and place - last >= least:
            ticks.append(tick)
    ticks.append(highest)
    return axis(
        type="log", tickangle=0,
        range=[first + 0.12 * (first - last), first - (first - last) / DOTS],
        tickvals=[100.0 - tick for tick in ticks], ticktext=[f"{tick:g}" for tick in ticks],
    )  # fmt: skip


def _ends(fits: Sequence[float]) -> tuple[float, float]:
    """The two values of NUMBERED that enclose all `fits`."""
    below = [n for n in NUMBERED[:-1] if n <= min(fits)]
    first = below[-1] if below else NUMBERED[0]
    above = [n for n in NUMBERED if n >= max(fits) and n > first]
    return first, above[0] if above else NUMBERED[-1]


def _fit_marks(fits: Sequence[tuple[int, float]], role: str) -> Figure:
    """A mark for each (row, FIT in %) of the recordings of a role."""
    left = [min(max(100.0 - fit, LEAST_MISFIT), LARGEST_MISFIT) for _, fit in fits]
    found = dots(left, [row for row, _ in fits], f"FIT, {ROLES[role]}", colours.START)
    found["marker"] |= LOOK[role]
    found |= {"customdata": [fit for _, fit in fits]}
    return found | {"hovertemplate": "%{customdata:.4f} %<extra></extra>"}


def _fit_numbers(fits: Sequence[tuple[int, float]], at: float) -> Figure:
    """FIT as numbers at the end of each row; `at`: their position on the axis."""
    return {
        "type": "scatter", "mode": "text", "x": [at] * len(fits),
        "y": [row for row, _ in fits], "text": [format_percent(fit) for _, fit in fits],
        "textposition": "middle left", "hoverinfo": "skip", "showlegend": False,
        "textfont": {"size": 11},
    }  # fmt: skip


def bar_label(recording: RecordingComparison, among: Sequence[RecordingComparison]) -> str:
    """The recording's name, with the fit where one recording is compared with several."""
    same = [r for r in among if r.recording == recording.recording]
    if len(same) == 1:
        return recording.recording
    return f"{recording.recording} ({recording.fit_label})"
