"""The benchmark's table, comparison by comparison."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

from flexgui.core.plugins import modules_of
from tests.bench.row import FULL, duration, ratio
from tests.evidence.frame import table

TITLE = "Speed"
ORDER = 4
FILES: tuple[str, ...] = ()


def _measured(module: ModuleType, folder: Path) -> dict[str, Any]:
    """The rows of one comparison of `make bench`."""
    rows = module.rows(FULL)
    return {
        "rows": [
            [row.what, duration(row.ours), duration(row.peer), ratio(row),
             "" if row.same is None else "yes" if row.same else "NO"]
            for row in rows
        ]
    }  # fmt: skip


OWN_PROCESSES = ("study",)
"""Comparisons that start processes, as a case's own process may not: `make bench` has them."""

CASES: dict[str, Callable[[Path], dict[str, Any]]] = {
    name: partial(_measured, module)
    for module in modules_of("tests.bench.comparisons")
    if (name := module.__name__.rpartition(".")[2]) not in OWN_PROCESSES
}


def section(found: Mapping[str, Any]) -> str:
    """Markdown."""
    rows = [row for each in found.values() for row in each["rows"]]
    head = ("comparison", "FlexGUI", "peer", "ratio", "same answer")
    about = "As `make bench` measures it, on the machine that wrote this page; run it with `PARTS="
    return "\n\n".join(
        [f"{about}speed` and one worker on a machine that is idle.", table(head, rows)]
    )
