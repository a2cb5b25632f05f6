"""How well the model reproduces each output of each recording, as a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from core.results import ChannelComparison, RecordingComparison
from core.written import shown_unit
from flexgui.views.fit_bars import bar_label
from flexgui.views.names import channel_symbol
from flexgui.views.numbers import format_number, format_percent, with_unit
from flexgui.views.pooled import (
    ESTIMATE,
    VALIDATE,
    ChannelError,
    channel_errors,
    with_role,
)
from flexgui.views.table import Column, Row, Table

ROLES = {ESTIMATE: "estimation", VALIDATE: "validation"}

COLUMNS = (
    Column("Recording"),
    Column("Role"),
    Column("Output"),
    Column("FIT [%]", numeric=True),
    Column("Rms error", numeric=True),
    Column("‖r‖ / ‖y − mean‖ [–]", numeric=True),
    Column("‖r‖ / ‖y‖ [–]", numeric=True),
)


def fit_table(
    comparisons: Sequence[RecordingComparison], before: Sequence[RecordingComparison] = ()
) -> Table:
    """The means over the recordings of each role, then a row per recording and output; `before`:
    the same of the model as given, in columns of their own."""
    rows: list[Row] = []
    earlier = channel_errors_by_role(before)
    for role in (ESTIMATE, VALIDATE):
        chosen = with_role(comparisons, role)
        if len(chosen) > 1:
            rows.extend(_means(chosen, role, earlier.get(role) if before else None))
    given = {(r.recording, c.channel): c for r in before for c in r.channels}
    for recording in comparisons:
        for channel in recording.channels:
            row = _row(recording, channel, bar_label(recording, comparisons))
            was = given.get((recording.recording, channel.channel))
            rows.append(_beside(row, was) if before else row)
    columns = (*COLUMNS, *GIVEN_COLUMNS) if before else COLUMNS
    return Table(
        columns,
        tuple(rows),
        "r: measured minus model. y: measured. An output marked * was not fitted. "
        "FIT = 100 (1 − ‖r‖ / ‖y − mean‖), not below 0. "
        "In the rows of all recordings FIT is a mean and the rms error counts all samples alike.",
    )


GIVEN_COLUMNS = (
    Column("FIT as given [%]", numeric=True),
    Column("Rms as given", numeric=True),
)


def channel_errors_by_role(
    comparisons: Sequence[RecordingComparison],
) -> dict[str, dict[str, ChannelError]]:
    """role -> channel -> its error over all recordings of the role."""
    return {
        role: {e.channel: e for e in channel_errors(with_role(comparisons, role))}
        for role in (ESTIMATE, VALIDATE)
    }


def _beside(row: Row, was: ChannelComparison | ChannelError | None) -> Row:
    """The row with the figures of the model as given."""
    cells = ("", "")
    if was is not None:
        cells = (format_percent(was.fit_percent), in_unit(was.rms, was.unit))
    return replace(row, cells=(*row.cells, *cells))


def _row(recording: RecordingComparison, channel: ChannelComparison, label: str) -> Row:
    return Row(
        (
            label,
            ROLES.get(recording.role, recording.role),
            channel_symbol(channel.channel, channel.unit) + ("" if channel.fitted else " *"),
            format_percent(channel.fit_percent),
            in_unit(channel.rms, channel.unit),
            format_number(channel.normalised_error, 3, keep_zeros=True),
            format_number(channel.relative_error, 3, keep_zeros=True),
        )
    )


def _means(
    chosen: Sequence[RecordingComparison], role: str, before: Mapping[str, ChannelError] | None
) -> list[Row]:
    rows = []
    for error in channel_errors(chosen):
        cells = (
            f"all {len(chosen)}",
            ROLES[role],
            channel_symbol(error.channel, error.unit) + ("" if error.fitted else " *"),
            format_percent(error.fit_percent),
            in_unit(error.rms, error.unit),
            "",
            "",
        )
        row = Row(cells, strong=True)
        rows.append(row if before is None else _beside(row, before.get(error.channel)))
    return rows


def in_unit(value: float, unit: str, digits: int = 3) -> str:
    """A size in a unit that suits it: '0.21 mm'."""
    if not np.isfinite(value):
        return "–"
    shown = shown_unit(value, unit)
    return with_unit(format_number(value * shown.factor, digits, keep_zeros=True), shown.name)
