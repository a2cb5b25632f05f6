"""Who gets how much of the window, without a browser."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgui.page.in_browser import asset
from flexgui.page.layout import (
    ARM,
    BORDERS,
    CONTROLS,
    LEAST_CONTROLS,
    LEAST_PLOTS,
    PLOTS,
    PLOTS_SHARE,
    TWO_COLUMNS,
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


@pytest.mark.parametrize("width", [1500.0, 1600.0, 1920.0, 2560.0])
def test_the_plots_of_a_wide_window_have_their_share(width: float) -> None:
    shares = widths(Window(width, 900.0))
    assert shares.controls == CONTROLS
    assert shares.plots == pytest.approx(max(PLOTS_SHARE * width, PLOTS), abs=ROUNDED)


def test_plots_stand_in_two_columns_where_there_is_room() -> None:
    style = asset("page.css")
    edge = TWO_COLUMNS / PLOTS_SHARE
    assert (
        widths(Window(edge + 3.0, 900.0)).columns,
        widths(Window(edge - 3.0, 900.0)).columns,
    ) == (2, 1)
    assert f"@media (min-width: {edge:.0f}px)" in style


@pytest.mark.parametrize("width", [1100.0, 1280.0, 1366.0])
def test_the_arm_of_a_narrow_window_keeps_its_room(width: float) -> None:
    assert picture(width) == pytest.approx(ARM, abs=ROUNDED)


@given(st.floats(100.0, 5000.0), st.floats(100.0, 5000.0))
def test_a_wider_window_takes_from_nobody(one: float, other: float) -> None:
    narrow, wide = (widths(Window(w, 800.0)) for w in sorted((one, other)))
    assert LEAST_PLOTS <= narrow.plots <= wide.plots
    assert LEAST_CONTROLS <= narrow.controls <= wide.controls <= CONTROLS


def test_the_picture_of_a_phone_is_its_whole_window() -> None:
    assert aspect(Window(390.0, 844.0)) == 390.0 / 844.0
    assert aspect(Window(1600.0, 900.0)) == pytest.approx(600.0 / 900.0)


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
