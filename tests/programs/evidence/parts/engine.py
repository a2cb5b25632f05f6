"""Recordings of an independent engine: what is named, and how large."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from flexgui.core.scenario.read import read_scenario
from flexgui.core.workbench import run_scenario
from flexgui.export.result import result
from tests.programs.evidence.engine_words import set_right, text
from tests.programs.evidence.frame import Summary
from tests.programs.mujoco.wide_cases import CASES as WIDE
from tests.programs.mujoco.wide_cases import Case
from tests.programs.mujoco.wide_files import written

TITLE = "An independent engine"
ORDER = 2
FILES: tuple[str, ...] = ()
SOURCES = ("mujoco/chain.py", "mujoco/wide_*.py")

MODES = "extra_bending_mode"
"""Has no parameter: the ladder names it."""


def diagnosed(case: Case, folder: Path) -> dict[str, Any]:
    """What the diagnosis says of a case whose files alone it sees."""
    _, _, truth = case.made()
    with tempfile.TemporaryDirectory() as place:
        path = written(case, Path(place))
        outcome = run_scenario(read_scenario(path), folder=path.parent)
    found = result(outcome, [])
    added = [step["added"] for step in found["steps"][1:]]
    kinds = {p["of"] for p in found["parameters"]} - {"arm", "drive", "sensor"}
    return {
        "truth": truth,
        "first": added[0] if added else None,
        "added": added,
        "named": sorted(kinds | ({MODES} & set(added))),
        "values": {p["name"]: p["value"] for p in found["parameters"]},
        "of": {p["name"]: p["of"] for p in found["parameters"]},
        "EI": [beam.EI for beam in case.made()[0].beams],
        "tip_mm": [1e3 * step["tip_rms_m"] for step in found["steps"] if step["tip_rms_m"]],
        "verdict": found["verdict"],
        "final_verdict": found["final_verdict"],
        "seconds": found["seconds"]["diagnose"],
        "level": found["level"],
    }


CASES: dict[str, Callable[[Path], dict[str, Any]]] = {
    name: partial(diagnosed, case) for name, case in WIDE.items()
}


def _confusion(found: Mapping[str, Any]) -> Any:
    from tests.programs.evidence.figures import confusion, first_named

    return confusion(first_named(found)) if first_named(found) else None


FIGURES = {"engine_confusion": ("Hidden alone, and named first", _confusion)}


def summary(found: Mapping[str, Any]) -> Summary:
    """No tool that was found names what is missing; docs/benchmark.md asks for others."""
    hidden = [one for one in found.values() if one["truth"]]
    if not hidden:
        return []
    right = sum(set_right(one) for one in hidden)
    return [
        ("engine: just what is hidden is named", f"{right} of {len(hidden)}", "none known", "–")
    ]


def section(found: Mapping[str, Any]) -> str:
    """Markdown."""
    return text(found, WIDE)
