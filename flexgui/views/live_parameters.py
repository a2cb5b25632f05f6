"""The parameters of a search while it runs, as a table."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.written import shown_unit
from flexgui.views.live_search import History, Searched
from flexgui.views.names import typeset
from flexgui.views.numbers import format_number, with_unit
from flexgui.views.table import Column, Row, Table

COLUMNS = (
    Column("Parameter"),
    Column("Best so far", numeric=True),
    Column("Spread of the population", numeric=True),
    Column("Bounds", numeric=True),
)


def live_parameters(history: History, searched: Sequence[Searched]) -> Table | None:
    """Of the newest fit; None before its first generation."""
    if not history:
        return None
    label, told = list(history.items())[-1]
    newest = told[-1]
    rows = []
    for k, s in enumerate(searched[: len(newest.best_vector)]):
        value = float(newest.best_vector[k])
        unit = shown_unit(value, s.unit)
        spread = float("nan")
        if newest.population is not None:
            spread = float(np.std(newest.population[:, k]))
        ends = " … ".join(format_number(end * unit.factor, 3) for end in (s.lower, s.upper))
        rows.append(
            Row(
                (
                    typeset(s.symbol, s.name),
                    with_unit(format_number(value * unit.factor, 5, keep_zeros=True), unit.name),
                    with_unit(format_number(spread * unit.factor, 2), unit.name),
                    with_unit(ends, unit.name),
                )
            )
        )
    return Table(COLUMNS, tuple(rows), f"{label}, generation {newest.number}.")
