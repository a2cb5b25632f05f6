"""The benchmark's table, comparison by comparison."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

from flexgui.core.plugins import modules_of
from tests.programs.bench.row import FULL, duration, least_flattering_first, ratio
from tests.programs.evidence.frame import table

TITLE = "Speed"
ORDER = 4
FILES: tuple[str, ...] = ()
SOURCES = ("bench/**/*.py",)


def _measured(module: ModuleType, folder: Path) -> dict[str, Any]:
    """The rows of one comparison of `make bench`."""
    rows = least_flattering_first(module.rows(FULL))
    return {
        "rows": [
            [row.what, duration(row.ours), duration(row.peer), ratio(row), row.errors,
             "" if row.same is None else "yes" if row.same else "NO"]
            for row in rows
        ]
    }  # fmt: skip


CASES: dict[str, Callable[[Path], dict[str, Any]]] = {
    module.__name__.rpartition(".")[2]: partial(_measured, module)
    for module in modules_of("tests.programs.bench.comparisons")
}


ABOUT = (
    "As `make bench` measures it, on the machine that wrote this page; run it with `PARTS=speed` "
    "and one worker on a machine that is idle. A ratio below one: FlexGUI is slower. Of each "
    "question the least flattering peer comes first. Errors are differences to a reference with "
    "far more steps or digits, where none is named. `make bench` also states the steps of both "
    "sides, the operations of a step and how long CasADi's code took to build."
)


def section(found: Mapping[str, Any]) -> str:
    """Markdown."""
    rows = [row for each in found.values() for row in each["rows"]]
    head = ("comparison", "FlexGUI", "peer", "ratio", "errors, FlexGUI / peer", "same answer")
    return "\n\n".join([ABOUT, table(head, rows)])
