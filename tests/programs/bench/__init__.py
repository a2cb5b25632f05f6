"""How fast FlexGUI is beside what an expert writes with SciPy, python-control, CasADi and MuJoCo.

Every comparison computes the same answer both ways from the same data in the same run, states the
error of both and prints the ratio of the times, of each question the least flattering one first.
One file per comparison.
"""

from __future__ import annotations

from rich.console import Console

from flexgui.core.plugins import modules_of
from tests.programs.bench.row import FULL, QUICK, Row, table


def measure(quick: bool) -> list[Row]:
    """The rows of all comparisons, in the order of their files."""
    size = QUICK if quick else FULL
    return [row for module in modules_of(f"{__name__}.comparisons") for row in module.rows(size)]


def main(quick: bool = False) -> int | None:
    """Prints the table; 1 where some answer was not the same."""
    rows = measure(quick)
    Console().print(table(rows, quick))
    return None if all(row.same is not False for row in rows) else 1
