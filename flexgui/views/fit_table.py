"""How well the model reproduces each output of each recording, as a table."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.results import ChannelComparison, RecordingComparison
from flexgui.views.fit_bars import bar_label
from flexgui.views.names import channel_symbol
from flexgui.views.numbers import format_number, format_percent, with_unit
from flexgui.views.pooled import ESTIMATE, VALIDATE, channel_errors, with_role
from flexgui.views.table import Column, Row, Table
from flexgui.views.units import shown_unit

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


def fit_table(comparisons: Sequence[RecordingComparison]) -> Table:
    """The means over the recordings of each role, then a row per recording and output."""
    rows: list[Row] = []
    for role in (ESTIMATE, VALIDATE):
        chosen = with_role(comparisons, role)
        if len(chosen) > 1:
            rows.extend(_means(chosen, role))
    rows.extend(
        _row(recording, channel, bar_label(recording, comparisons))
        for recording in comparisons
        for channel in recording.channels
    )
    return Table(
        COLUMNS,
        tuple(rows),
        "r: measured minus model. y: measured. An output marked * was not fitted. "
        "FIT = 100 (1 − ‖r‖ / ‖y − mean‖), not below 0. "
        "In the rows of all recordings FIT is a mean and the rms error counts all samples alike.",
    )


def _row(recording: RecordingComparison, channel: ChannelComparison, label: str) -> Row:
    return Row(
        (
            label,
            ROLES.get(recording.role, recording.role),
            channel_symbol(channel.channel) + ("" if channel.fitted else " *"),
            format_percent(channel.fit_percent),
            in_unit(channel.rms, channel.unit),
            format_number(channel.normalised_error, 3, keep_zeros=True),
            format_number(channel.relative_error, 3, keep_zeros=True),
        )
    )


def _means(chosen: Sequence[RecordingComparison], role: str) -> list[Row]:
    return [
        Row(
            (
                f"all {len(chosen)}",
                ROLES[role],
                channel_symbol(error.channel) + ("" if error.fitted else " *"),
                format_percent(error.fit_percent),
                in_unit(error.rms, error.unit),
                "",
                "",
            ),
            strong=True,
        )
        for error in channel_errors(chosen)
    ]


def in_unit(value: float, unit: str, digits: int = 3) -> str:
    """A size in a unit that suits it: '0.21 mm'."""
    if not np.isfinite(value):
        return "–"
    shown = shown_unit(value, unit)
    return with_unit(format_number(value * shown.factor, digits, keep_zeros=True), shown.name)
