"""How time and memory grow with samples, recordings and candidates."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from tests.programs.evidence.figures import curves
from tests.programs.evidence.frame import table

TITLE = "Growth"
ORDER = 5
FILES: tuple[str, ...] = ()
SOURCES = ("evidence/growth_run.py", "bench/case.py")

FACTORS = {"samples": (1, 2, 4, 8), "recordings": (1, 2, 4, 8), "candidates": (2, 4, 8, 16)}
UNITS = {"samples": 750, "recordings": 1, "candidates": 1}
"""Of a factor: samples of each of two recordings, recordings of 1,500 samples, candidates."""


def _measured(axis: str, folder: Path) -> dict[str, Any]:
    """One process per size, since the peak of the memory is a process's."""
    command = [sys.executable, "-m", "tests.programs.evidence.growth_run", axis]
    runs = [subprocess.run([*command, str(k)], check=True, capture_output=True, text=True)
            for k in FACTORS[axis]]  # fmt: skip
    return {"runs": [json.loads(run.stdout) for run in runs]}


CASES = {axis: partial(_measured, axis) for axis in FACTORS}


def _figure(found: Mapping[str, Any]) -> Any:
    lines = {axis: (FACTORS[axis], one["runs"]) for axis, one in found.items()}
    return curves(lines) if lines else None


FIGURES = {"growth": ("Processor time and memory over the size", _figure)}


def section(found: Mapping[str, Any]) -> str:
    """Markdown."""
    rows = [
        [f"{axis}: {factor * UNITS[axis]:,}", f"{run['seconds']:.1f} s", f"{run['cpu']:.1f} s",
         f"{run['memory']:.0f} MB"]
        for axis, one in found.items()
        for factor, run in zip(FACTORS[axis], one["runs"], strict=True)
    ]  # fmt: skip
    about = (
        "A scenario from its files to its fit, two modes per segment: two recordings with more and "
        "more samples, then more and more recordings of 1,500 samples. Last, with a diagnosis of "
        "viscous friction: two recordings of 1,000 samples, one mode, more and more candidates. "
        "Time is that of a second run in a process. Memory is the largest that the process ever "
        "had."
    )
    head = ("size", "time", "processor time", "memory")
    return "\n\n".join([about, table(head, rows)])
