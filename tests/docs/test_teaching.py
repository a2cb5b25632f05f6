"""The sheets for a class: one page each; the teacher's answers are what the program computes."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from flexgui.core.scenario.read import read_scenario
from tests.programs.docs.answers import FILE, SCENARIOS, SHEETS, digest, text

SHEET_FILES = sorted(FILE.parent.glob("[0-9]_*.md"))

MOST_LINES = 60
"""Of a printed page."""


def sheet(scenario: str) -> Path:
    """The one that begins with this scenario."""
    (found,) = [p for p in SHEET_FILES if f"teaching/{scenario}.toml" in p.read_text("utf-8")]
    return found


def questions(content: str) -> int:
    return len(re.findall(r"(?m)^\d+\. ", content))


@pytest.mark.parametrize("scenario", SHEETS)
def test_a_sheet_has_one_page_a_challenge_and_fresh_answers(scenario: str) -> None:
    content = sheet(scenario).read_text(encoding="utf-8")
    title, seed, level, _ = SHEETS[scenario]
    assert content.startswith(f"# {title}\n")
    assert content.count("\n") <= MOST_LINES
    assert f"seed **{seed}**, level *{level}*" in " ".join(content.split())
    part = FILE.read_text(encoding="utf-8").split(f"## {title}\n")[1].split("\n## ")[0]
    assert questions(part) == questions(content) > 5
    assert read_scenario(SCENARIOS / f"{scenario}.toml").title == title
    kept = FILE.read_text(encoding="utf-8")
    fresh = f"<!-- {scenario}: {digest(scenario)} -->"
    assert fresh in kept, "run: python -m tests.programs.docs.answers"


def test_every_sheet_and_every_scenario_has_its_answers() -> None:
    assert len(SHEET_FILES) == len(SHEETS) == len(list(SCENARIOS.glob("*.toml")))


@pytest.mark.long
def test_the_answers_are_fresh() -> None:
    assert FILE.read_text(encoding="utf-8") == text(), "run: python -m tests.programs.docs.answers"
