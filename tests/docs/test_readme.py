"""README claims nothing that docs/evidence.md does not show."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.programs.evidence.frame import PAGE, heading, parts

pytestmark = pytest.mark.long

README = Path(__file__).resolve().parents[2] / "README.md"
ROWS = [
    line.strip("|\n ").split(" | ")
    for line in README.read_text(encoding="utf-8").splitlines()
    if line.startswith("| ") and "PARTS=" in line
]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0])
def test_a_figure_of_the_readme_stands_in_its_part_of_the_evidence(row: list[str]) -> None:
    assert len(ROWS) == 5
    name = re.findall(r"PARTS=(\w+)", row[3])[0]
    title = parts()[name].TITLE
    section = PAGE.read_text(encoding="utf-8").split(f"## {title}\n")[1].split("\n## ")[0]
    ours, beside = row[1], re.findall(r"[\d.]+(?: of \d+)?", row[2])[0]
    assert f" {ours} " in section
    assert beside in section
    assert f"docs/evidence.md#{heading(title)}" in row[3]
