"""Who gets how much of the window, without a browser."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgui.page.layout import (
    ARM,
    BORDERS,
    CONTROLS,
    LEAST_CONTROLS,
    LEAST_PLOTS,
    LINE,
    LINE_MARGIN,
    PLOTS,
    Window,
    aspect,
    widths,
    window_of,
)

pytestmark = pytest.mark.long

ROUNDED = 1.0
"""px: widths are whole."""


def picture(width: float) -> float:
    shares = widths(Window(width, 800.0))
    return width - shares.plots - shares.controls - BORDERS


def test_a_wide_window_gives_everybody_what_they_want() -> None:
    shares = widths(Window(1600.0, 900.0))
    assert (shares.plots, shares.controls, shares.line) == (PLOTS, CONTROLS, LINE)


@pytest.mark.parametrize("width", [1100.0, 1280.0, 1366.0])
def test_the_arm_of_a_narrow_window_keeps_its_room(width: float) -> None:
    assert picture(width) == pytest.approx(ARM, abs=ROUNDED)


@given(st.floats(1000.0, 4000.0))
def test_the_time_line_lies_inside_the_picture(width: float) -> None:
    assert widths(Window(width, 800.0)).line <= picture(width) - 2.0 * LINE_MARGIN + ROUNDED


@given(st.floats(100.0, 5000.0), st.floats(100.0, 5000.0))
def test_a_wider_window_takes_from_nobody(one: float, other: float) -> None:
    narrow, wide = (widths(Window(w, 800.0)) for w in sorted((one, other)))
    assert LEAST_PLOTS <= narrow.plots <= wide.plots <= PLOTS
    assert LEAST_CONTROLS <= narrow.controls <= wide.controls <= CONTROLS
    assert narrow.line <= wide.line


def test_a_border_that_was_moved_counts_for_the_time_line() -> None:
    assert widths(Window(1600.0, 900.0, picture=440.0)).line == 440.0 - 2.0 * LINE_MARGIN


def test_the_picture_of_a_phone_is_its_whole_window() -> None:
    assert aspect(Window(390.0, 844.0)) == 390.0 / 844.0
    assert aspect(Window(1600.0, 900.0)) == pytest.approx(632.0 / 900.0)


def test_what_a_browser_wrote_down_is_read() -> None:
    assert window_of("1280 720 420") == Window(1280.0, 720.0, 420.0)
    assert window_of("1280 720 420 dark") == Window(1280.0, 720.0, 420.0, system_dark=True)
    chosen = Window(1280.0, 720.0, 420.0, system_dark=True, theme="light")
    assert window_of("1280 720 420 dark light") == chosen
    assert window_of("1280 720 420 light gpu") == Window(1280.0, 720.0, 420.0, gpu=True)


@pytest.mark.parametrize(
    "text", [None, "", "1280", "1e9 720 0", "nan 720 0", "1280 720 -5", "1 2 3 blue"]
)
def test_anything_else_is_not(text: str | None) -> None:
    assert window_of(text) is None
