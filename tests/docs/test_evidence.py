"""The page of the evidence is made of its parts' records and of nothing else."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests.programs.evidence import frame

ROWS = frame.MOST_ROWS


def table(rows: int) -> str:
    return frame.table(("a", "b"), [[str(k), str(k)] for k in range(rows)])


def part(title: str, rows: int) -> Any:
    """One case, whose figure stands beside a peer's."""
    return SimpleNamespace(
        TITLE=title, ORDER=1, FILES=(), CASES={"only": None},
        section=lambda found: table(rows),
        summary=lambda found: [
            (title, str(one["ours"]), "2, a peer", frame.better(one["ours"], 2.0))
            for one in found.values()
        ],
    )  # fmt: skip


@pytest.fixture
def journal(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    made = {"short": part("A short part", ROWS), "long": part("A long part", ROWS + 1)}
    monkeypatch.setattr(frame, "parts", lambda: made)
    monkeypatch.setattr(frame, "digest", lambda name: "0")
    return tmp_path / "journal.jsonl"


def record(name: str, ours: float, used: str) -> str:
    found = {"key": f"{name}/only/0", "found": {"ours": ours}, "seconds": 1800.0,
             "date": "2026-01-01", "with": used, "on": "one machine"}  # fmt: skip
    return json.dumps(found) + "\n"


def test_one_table_says_who_is_better_and_where_that_stands(journal: Path) -> None:
    journal.write_text(record("short", 1.0, "x 1") + record("long", 3.0, "x 1"))
    page = frame.page(None, journal)
    assert "| A short part | 1.0 | 2, a peer | FlexGUI | [short](#a-short-part) |" in page
    assert "| A long part | 3.0 | 2, a peer | **peer** | [long](#a-long-part) |" in page
    assert frame.better(2.01, 2.0) == "neither"


def test_what_all_parts_were_made_with_is_stated_once_with_the_time_of_all(journal: Path) -> None:
    journal.write_text(record("short", 1.0, "x 1") + record("long", 3.0, "x 1"))
    page = frame.page(None, journal)
    assert page.count("x 1") == 1
    assert "1 hours of processor time on one machine" in page
    assert "`make evidence PARTS=short`, 1800 s of processor time" in page


def test_parts_of_different_revisions_state_their_own(journal: Path) -> None:
    journal.write_text(record("short", 1.0, "x 1") + record("long", 3.0, "x 2"))
    page = frame.page(None, journal)
    assert (page.count("x 1"), page.count("x 2")) == (1, 1)


def test_long_tables_alone_are_folded(journal: Path) -> None:
    journal.write_text(record("short", 1.0, "x 1") + record("long", 3.0, "x 1"))
    first, second = frame.page(None, journal).split("## A long part")
    assert "<details" not in first
    assert f"<summary>{ROWS + 1} rows</summary>" in second
    assert table(ROWS + 1) in second


def test_a_part_that_was_made_by_itself_leaves_the_others_as_they_are(journal: Path) -> None:
    journal.write_text(record("short", 1.0, "x 1") + record("long", 3.0, "x 1"))
    whole = frame.page(None, journal)
    journal.write_text(record("short", 1.5, "x 2"))
    page = frame.page(None, journal, whole)
    assert "| A short part | 1.5 | 2, a peer | FlexGUI | [short](#a-short-part) |" in page
    assert "| A long part | 3.0 | 2, a peer | **peer** | [long](#a-long-part) |" in page
    assert "1 hours of processor time on one machine, with x 1" in page  # all but this part
    assert "*2026-01-01; x 2.*" in page
