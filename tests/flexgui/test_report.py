"""The report: its first page, its weight, what stays on one line, and the motion in 3-D."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from markupsafe import Markup

from flexgui.core.results import Outcome
from flexgui.core.scenario.read import parse_scenario
from flexgui.core.workbench import run_scenario
from flexgui.export.report import FEWEST_POINTS, PER_CHANNEL, SIGNALS, points_per_line, report_html
from flexgui.export.report_motion import report_motion
from flexgui.export.report_sections import digest
from flexgui.export.template import NO_BREAK, glued
from flexgui.views.layout import MOST_POINTS
from flexgui.views.summary import DOUBTFUL, provisional_warning


def test_other_data_have_another_digest(glocal: Outcome) -> None:
    first, *rest = glocal.comparisons
    channel = replace(first.channels[0], measured=np.roll(first.channels[0].measured, 1))
    moved = replace(first, channels=(channel, *first.channels[1:]))
    assert digest(replace(glocal, comparisons=(moved, *rest))) != digest(glocal)
    assert digest(replace(glocal)) == digest(glocal)


def test_far_from_the_floor_it_is_said_that_all_rests_on_a_complete_model() -> None:
    assert provisional_warning(DOUBTFUL) == "" == provisional_warning(float("nan"))
    assert provisional_warning(9.0).startswith("Provisional: overall error 9.0× noise floor.")


def recordings(counts: list[int]) -> Any:
    return cast(Any, tuple(SimpleNamespace(channels=[None] * n) for n in counts))


@given(st.lists(st.integers(0, 12), max_size=200))
def test_all_signals_together_keep_the_budget_or_are_as_coarse_as_can_be(counts: list[int]) -> None:
    points = points_per_line(recordings(counts))
    assert FEWEST_POINTS <= points <= MOST_POINTS
    assert points == FEWEST_POINTS or PER_CHANNEL * sum(counts) * points <= SIGNALS


def test_more_recordings_are_never_drawn_finer() -> None:
    found = [points_per_line(recordings([6] * n)) for n in range(1, 40)]
    assert found[0] == MOST_POINTS
    assert found == sorted(found, reverse=True)


WHOLE = [
    "520.83 ± 0.02 N m²",
    "1.1997 ± 0.0015 N m",
    "4.723 ± 0.010 N m s/rad",
    "3 N / m²",
    "-12.72 ± 0.07 mN m",
    "1.54 × 10⁶",
    "(1.20 ± 0.05) × 10⁹ N/m²",
    "38 %",
    "0.28 mm",
]


@pytest.mark.parametrize("text", WHOLE[:5] + WHOLE[7:])
def test_no_line_breaks_inside_a_quantity(text: str) -> None:
    assert " " not in glued(text)
    half = glued(f"EI is 1.20{NO_BREAK}± 0.01 N m, and 5 more.").replace(NO_BREAK, "_")
    assert half == "EI is 1.20_±_0.01_N_m, and 5 more."
    assert isinstance(glued(Markup("f<sub>1</sub> = 3 N m")), Markup)


@given(st.text("019.,±×⁰⁶²/()%-N mEIθ\u00a0\u202f <&"))
def test_only_spaces_are_changed(text: str) -> None:
    assert glued(text).replace(NO_BREAK, " ") == text.replace(NO_BREAK, " ")


PLAYED = """
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
LARGEST_PLAYER = 1.2e6
"""Characters that the player adds; the viewer itself is most of them."""
DRAWN = 20_000
"""ms that a browser without a graphics card may take."""


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    return run_scenario(parse_scenario(PLAYED, "two.toml"))


def test_the_validation_is_played(outcome: Outcome, tmp_path: Path) -> None:
    motion = report_motion(parse_scenario(PLAYED, "two.toml"), outcome, tmp_path)
    assert motion is not None
    assert motion.note.startswith("other: ") and "translucent" in motion.note
    assert len(motion.player) < LARGEST_PLAYER
    assert "<iframe" in report_html(outcome, PLAYED, motion)
    assert "<iframe" not in report_html(outcome, PLAYED)


def test_a_recording_that_is_gone_leaves_the_report_without_a_motion_and_says_so(
    outcome: Outcome, tmp_path: Path
) -> None:
    text = PLAYED.replace("simulate = {theta2 = 2.0, seconds = 0.3, seed = 2}", 'file = "x.csv"')
    motion = report_motion(parse_scenario(text, "two.toml"), outcome, tmp_path)
    assert motion is not None and not motion.player and "x.csv" in motion.note
    assert motion.note in Markup(report_html(outcome, PLAYED, motion)).unescape()


def test_the_report_plays_it_without_a_network(
    outcome: Outcome, tmp_path: Path, chromium: Any
) -> None:
    """The page's own rule against loading anything must not stop its player."""
    motion = report_motion(parse_scenario(PLAYED, "two.toml"), outcome, tmp_path)
    path = tmp_path / "report.html"
    path.write_text(report_html(outcome, PLAYED, motion), encoding="utf-8")
    page = chromium.new_page()
    page.goto(path.as_uri())
    page.locator("#motion").scroll_into_view_if_needed()
    frame = page.frame_locator("#motion iframe")
    frame.locator("canvas").first.wait_for(timeout=DRAWN)
    frame.get_by_text("1x").or_(frame.locator("input[value='1x']")).first.wait_for(timeout=DRAWN)
    page.close()
