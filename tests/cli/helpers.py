"""A small valid scenario with its recording, to be spoilt in one place."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
from typer.testing import CliRunner, Result

from flexgui.cli import app
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.simulate.experiment import simulate_recording
from tests.helpers import PAPER, looped

FILE = "th1.csv"
SCENARIO = "case.toml"
ROWS = 120
COLUMNS = ("t", "dtheta1_ref", "dtheta2_ref", "theta1", "theta2", "z1", "z2")

TEXT = """\
title = "One recording"
[arm]
preset = "paper"
[drive]
kind = "velocity_loop"
gains = [60.0, 30.0]
[model]
level = "lpv"
[sensors]
camera_noise = 3e-5
[[recordings]]
file = "th1.csv"
theta2 = 1.2
[identify]
parameters = ["EI1", "EI2"]
output = "ydot"
generations = 0
population = 10
bounds = {EI1 = [400.0, 700.0]}
[diagnose]
max_effects = 0
"""

Table = list[list[str]]
"""Header and rows of cells."""


@cache
def _rows(theta2: float) -> tuple[tuple[str, ...], ...]:
    spec = SimulateSpec(theta2=theta2, seconds=ROWS * 1e-3, level="lpv")
    found = simulate_recording(looped(PAPER, level="lpv"), spec, "th1")
    columns = [found.time, *(found[name] for name in COLUMNS[1:])]
    return tuple(tuple(f"{x:.9g}" for x in row) for row in np.column_stack(columns))


def table(theta2: float = 1.2) -> Table:
    """The undamaged recording, rows numbered from 1 after the header."""
    return [list(COLUMNS), *(list(row) for row in _rows(theta2))]


def csv(lines: Table) -> str:
    return "\n".join(",".join(line) for line in lines) + "\n"


@dataclass(frozen=True)
class Case:
    """What lies in the folder, how it is called and what the sentence must name."""

    label: str
    words: tuple[str, ...]
    text: str = TEXT
    files: dict[str, str | bytes] = field(default_factory=lambda: {FILE: csv(table())})
    scenario: str = SCENARIO
    out: str = "out"

    def __str__(self) -> str:
        return self.label


def swapped(old: str, new: str) -> str:
    """The scenario's text with one place changed."""
    assert TEXT.count(old) == 1, old
    return TEXT.replace(old, new)


def arrange(case: Case, folder: Path) -> None:
    """Writes the case's files."""
    (folder / SCENARIO).write_text(case.text, encoding="utf-8")
    for name, content in case.files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.encode() if isinstance(content, str) else content)


def export(case: Case, folder: Path) -> Result:
    """The command line, in process; a slow machine would tell its progress."""
    out = str(folder / case.out)
    return said("export", str(folder / case.scenario), "--out", out, "--quiet")


def said(*arguments: str) -> Result:
    """What any command says, in process."""
    return CliRunner().invoke(app, list(arguments))
