"""The benchmark's table, comparison by comparison."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

from flexgui.core.plugins import modules_of
from tests.bench.row import FULL, duration, least_flattering_first, ratio
from tests.evidence.frame import table

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
    for module in modules_of("tests.bench.comparisons")
}


def section(found: Mapping[str, Any]) -> str:
    """Markdown."""
    rows = [row for each in found.values() for row in each["rows"]]
    head = ("comparison", "FlexGUI", "peer", "ratio", "errors, FlexGUI / peer", "same answer")
    about = "As `make bench` measures it, on the machine that wrote this page; run it with `PARTS="
    return "\n\n".join(
        [f"{about}speed` and one worker on a machine that is idle.", table(head, rows)]
    )
