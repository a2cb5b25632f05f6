"""The measure of the walk itself: it sees what is cut and what overlaps, and nothing else."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.long

BOXES = (Path(__file__).parent / "boxes.js").read_text(encoding="utf-8")

CUT = "<div style='width: 60px; overflow: hidden; white-space: nowrap'>much too long for it</div>"
SCROLLS = "<div style='width: 60px; overflow: auto; white-space: nowrap'>long, but it scrolls</div>"
ON = "<p style='position: absolute; top: 100px; left: 9px'>{}</p>"


def faults(chromium: Any, body: str) -> list[list[str]]:
    page = chromium.new_page()
    page.set_content(f"<body>{body}</body>")
    found = page.evaluate(BOXES)
    page.close()
    return list(found)


def test_what_is_cut_is_found_and_what_scrolls_is_not(chromium: Any) -> None:
    found = faults(chromium, CUT + SCROLLS)
    assert [fault[:2] for fault in found] == [["cut", "much too long for it"]]


def test_a_panel_that_scrolls_sideways_is_found(chromium: Any) -> None:
    panel = "<div class='mantine-ScrollArea-viewport' style='overflow: auto; width: 90px'>{}</div>"
    found = faults(chromium, panel.format("<div style='width: 98px'>a word</div>"))
    assert [fault[0] for fault in found] == ["sideways"]
    assert faults(chromium, panel.format("<div style='width: 90px'>a word</div>")) == []


def test_texts_on_one_another_are_found(chromium: Any) -> None:
    found = faults(chromium, ON.format("first words") + ON.format("other words"))
    assert found == [["overlap", "first words", "other words"]]
    assert faults(chromium, "<p>first words</p><p>other words</p>") == []
