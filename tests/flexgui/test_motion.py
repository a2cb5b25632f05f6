"""The motion in 3-D inside the report, on the real thing: short, but from end to end."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from markupsafe import Markup

from flexgui.core.results import Outcome
from flexgui.core.scenario.read import parse_scenario
from flexgui.core.workbench import run_scenario
from flexgui.export.report import report_html
from flexgui.export.report_motion import report_motion

SCENARIO = """
title = "Two points"
[arm]
preset = "paper"
[drive]
kind = "velocity_loop"
gains = [60.0, 30.0]
[[recordings]]
name = "one"
simulate = {theta2 = 1.2, seconds = 0.3, seed = 1}
[[recordings]]
name = "other"
role = "validate"
simulate = {theta2 = 2.0, seconds = 0.3, seed = 2}
"""
LARGEST = 1.2e6
"""Characters that the player adds; the viewer itself is most of them."""
DRAWN = 20_000
"""ms that a browser without a graphics card may take."""


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    return run_scenario(parse_scenario(SCENARIO, "two.toml"))


def test_the_validation_is_played(outcome: Outcome, tmp_path: Path) -> None:
    motion = report_motion(parse_scenario(SCENARIO, "two.toml"), outcome, tmp_path)
    assert motion is not None
    assert motion.note.startswith("other: ") and "translucent" in motion.note
    assert len(motion.player) < LARGEST
    assert "<iframe" in report_html(outcome, SCENARIO, motion)
    assert "<iframe" not in report_html(outcome, SCENARIO)


def test_a_recording_that_is_gone_leaves_the_report_without_a_motion_and_says_so(
    outcome: Outcome, tmp_path: Path
) -> None:
    text = SCENARIO.replace("simulate = {theta2 = 2.0, seconds = 0.3, seed = 2}", 'file = "x.csv"')
    motion = report_motion(parse_scenario(text, "two.toml"), outcome, tmp_path)
    assert motion is not None and not motion.player and "x.csv" in motion.note
    assert motion.note in Markup(report_html(outcome, SCENARIO, motion)).unescape()


def test_the_report_plays_it_without_a_network(
    outcome: Outcome, tmp_path: Path, chromium: Any
) -> None:
    """The page's own rule against loading anything must not stop its player."""
    motion = report_motion(parse_scenario(SCENARIO, "two.toml"), outcome, tmp_path)
    path = tmp_path / "report.html"
    path.write_text(report_html(outcome, SCENARIO, motion), encoding="utf-8")
    page = chromium.new_page()
    page.goto(path.as_uri())
    page.locator("#motion").scroll_into_view_if_needed()
    frame = page.frame_locator("#motion iframe")
    frame.locator("canvas").first.wait_for(timeout=DRAWN)
    frame.get_by_text("1x").or_(frame.locator("input[value='1x']")).first.wait_for(timeout=DRAWN)
    page.close()
