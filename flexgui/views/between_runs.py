"""How well each parameter repeats from run to run, as a table."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.results import Repeated
from core.written import ShownUnit, shown_unit
from flexgui.views.names import typeset
from flexgui.views.numbers import format_number, with_unit
from flexgui.views.table import Column, Row, Table

COLUMNS = (
    Column("Parameter"),
    Column("Mean of the runs", numeric=True),
    Column("95 % interval of the mean", numeric=True),
    Column("Std between runs", numeric=True),
    Column("Std within a run", numeric=True),
    Column("Runs that differ"),
)
CAPTION = (
    "Runs of the same experiment, each with estimates of its own. What a next run will give "
    "scatters by the deviation between runs; the deviation within a run knows nothing of what the "
    "rig changes from run to run (temperature, load, gain). Runs that differ are left out of mean "
    "and interval."
)


def between_runs(found: Sequence[Repeated]) -> Table | None:
    """A row per parameter; None where nothing was repeated."""
    return Table(COLUMNS, tuple(_row(one) for one in found), CAPTION) if found else None


def short_between_runs(found: Sequence[Repeated]) -> Table | None:
    """The same without the interval, for a panel beside the arm."""
    whole = between_runs(found)
    if whole is None:
        return None
    kept = (0, 1, 3, 4, 5)
    rows = tuple(Row(tuple(row.cells[k] for k in kept)) for row in whole.rows)
    return Table(tuple(COLUMNS[k] for k in kept), rows)


def _row(one: Repeated) -> Row:
    unit = shown_unit(one.mean, one.unit)
    odd = ", ".join(f"{each.run} by {100.0 * each.share:+.2g} %" for each in one.disagreeing)
    return Row(
        (
            typeset("", one.name),
            _shown(one.mean, unit, 4),
            _interval(one, unit),
            f"{_shown(one.between, unit, 2)}{_share(one.between, one.mean)}",
            f"{_shown(one.within, unit, 2)}{_share(one.within, one.mean)}",
            odd.replace("-", "−") or "none",
        )
    )


def _shown(value: float, unit: ShownUnit, digits: int) -> str:
    return with_unit(format_number(value * unit.factor, digits), unit.name)


def _interval(one: Repeated, unit: ShownUnit) -> str:
    ends = [format_number(end * unit.factor, 4) for end in one.interval]
    return with_unit(" … ".join(ends), unit.name) if np.isfinite(one.interval).all() else "–"


def _share(deviation: float, mean: float) -> str:
    return f" ({100.0 * deviation / abs(mean):.2g} %)" if mean else ""
