"""The vibrations of a posture as a table: frequency and damping, free and clamped."""

from __future__ import annotations

from collections.abc import Sequence

from core.simulate.modes import Mode
from flexgui.views.numbers import format_number
from flexgui.views.table import Column, Row, Table

UNDAMPED = 5e-7
"""A damping ratio below is rounding."""


def mode_table(modes: Sequence[Mode]) -> Table:
    """One row per vibration, slowest first."""
    columns = (
        Column("Mode"),
        Column("Frequency [Hz]", numeric=True),
        Column("Damping ratio [–]", numeric=True),
    )
    rows = (Row((f"{k + 1}", format_number(m.frequency), damping(m))) for k, m in enumerate(modes))
    return Table(columns, tuple(rows))


def damping(mode: Mode) -> str:
    """The damping ratio as text."""
    return "0" if abs(mode.damping) < UNDAMPED else format_number(mode.damping, 3)
