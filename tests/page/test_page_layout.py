"""Who gets how much of the window."""

from __future__ import annotations

import asyncio
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgui.core.effects import catalogue
from flexgui.core.results import RankedEffect
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
    PageLayout,
    Widths,
    Window,
    aspect,
    widths,
    window_of,
)
from flexgui.stages.diagnose.panel_candidates import WORDS
from flexgui.stages.diagnose.plots import SIZE as PICTURE
from flexgui.views.sketch import sparkline
from tests.page.conftest import FORGET, Desktop
from tests.page.helpers import SIZE, press
from tests.page.test_walk import BOXES, SETTLED
from tests.session.helpers import until

pytestmark = pytest.mark.long

ROUNDED = 1.0
"""px: widths are whole."""


@pytest.mark.parametrize("width", [1100.0, 1366.0, 1500.0, 1920.0, 2560.0])
def test_a_wide_window_gives_plots_their_share_and_a_narrow_one_the_arm_its_room(
    width: float,
) -> None:
    shares = widths(Window(width, 900.0))
    if width < 1400.0:
        assert width - shares.plots - shares.controls - BORDERS == pytest.approx(ARM, abs=ROUNDED)
    else:
        assert shares.controls == CONTROLS
        assert shares.plots == pytest.approx(max(PLOTS_SHARE * width, PLOTS), abs=ROUNDED)


def test_plots_stand_in_two_columns_where_there_is_room() -> None:
    edge = TWO_COLUMNS / PLOTS_SHARE
    assert [widths(Window(edge + x, 900.0)).columns for x in (3.0, -3.0)] == [2, 1]
    assert f"@media (min-width: {edge:.0f}px)" in asset("page.css")
    assert aspect(Window(390.0, 844.0)) == 390.0 / 844.0, "a phone's picture is its whole window"


@given(st.floats(100.0, 5000.0), st.floats(100.0, 5000.0))
def test_a_wider_window_takes_from_nobody(one: float, other: float) -> None:
    narrow, wide = (widths(Window(w, 800.0)) for w in sorted((one, other)))
    assert LEAST_PLOTS <= narrow.plots <= wide.plots
    assert LEAST_CONTROLS <= narrow.controls <= wide.controls <= CONTROLS


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


class SlowBrowser:
    """A client that answers each question but the second, and whose window has grown then."""

    client_id = 1

    def __init__(self) -> None:
        self.camera = self.local_storage = self._websock_connection = self
        self.aspect, self.answers = 1.0, iter(["1600 900 600", None, "2560 1440 1205"])

    def on_update(self, moved: Any) -> None:
        self.moved = moved

    def queue_message(self, message: object) -> None:
        pass

    def get_item(self, key: str, patience: float) -> str:
        answer = next(self.answers)
        if answer is None:
            raise TimeoutError
        return answer


def test_a_browser_that_is_busy_with_its_new_size_is_asked_again() -> None:
    browser, seen = SlowBrowser(), list[Widths]()
    layout = PageLayout(browser)  # type: ignore[arg-type]
    layout.begin(lambda window, shares: seen.append(shares))
    browser.aspect = 0.5
    with ThreadPoolExecutor(1) as apart:  # in this thread the loop of the real browser runs
        apart.submit(asyncio.run, browser.moved(browser)).result()
    until(lambda: seen[-1] == widths(Window(2560.0, 1440.0)))
    layout.close()


AREAS = """() => {
  const boxes = [...document.querySelectorAll(".mantine-ScrollArea-root, canvas[data-engine]")]
    .map(e => e.getBoundingClientRect()).filter(box => box.width > 0);
  const [left, picture, right] = boxes.sort((a, b) => a.left - b.left);
  const line = document.querySelector("#fx-line").getBoundingClientRect();
  return boxes.length === 3 ? [left.left, left.right, picture.left, line.left, line.right,
    picture.right, right.left, right.right, innerWidth] : [];
}"""
"""The edges of plots, picture with its time-line, and controls, from the left to the right."""


NARROW = 1280.0
"""px of a window whose time-line has the short words."""
ANEW = """document.querySelector(".js-plotly-plot:not([data-before])")
  && !document.querySelector("[data-before]")"""
"""A plot stands, and none from before."""


def stand_side_by_side(page: Any, width: float, height: float) -> bool:
    """Whether no area lies on another one, and the plots have the width that suits the window."""
    edges = page.evaluate(AREAS)
    ordered = all(a <= b + ROUNDED for a, b in zip(edges, edges[1:], strict=False))
    wide = bool(edges) and abs(edges[1] - edges[0] - widths(Window(width, height)).plots) < BORDERS
    return wide and ordered


def test_the_panels_follow_the_window_and_return_after_a_lost_connection(
    page: Any, desktop: Desktop
) -> None:
    press(page, "Data")
    for width, height in ((2560, 1440), (1280, 720), (1600, 900)):
        page.set_viewport_size({"width": width, "height": height})
        until(lambda: stand_side_by_side(page, width, height))  # noqa: B023
        page.evaluate(FORGET)
        desktop.server._websock_server.disconnect_all_clients()
        page.wait_for_function(ANEW)
        until(lambda: stand_side_by_side(page, width, height))  # noqa: B023
        page.wait_for_timeout(SETTLED)
        assert stand_side_by_side(page, width, height)
        assert not page.evaluate(BOXES)
        said = page.locator("#fx-line .speed").evaluate("e => e.selectedOptions[0].text")
        assert said.startswith("speed") is (width > NARROW)


FILLED = """least => {
  const figures = [...document.querySelectorAll(".js-plotly-plot")].filter(f => f.clientWidth);
  return figures.length && figures.every(figure => {
    const box = figure.parentElement.clientWidth;
    const drawn = figure.querySelector(".main-svg").clientWidth;
    const legend = figure.querySelector(".legend")?.getBoundingClientRect();
    const frame = figure.querySelector(".nsewdrag").getBoundingClientRect();
    return box > least && Math.abs(box - drawn) < 4 && (!legend || legend.bottom <= frame.top + 2);
  });
}"""
"""Every figure is as wide as its box, and its legend stands above the lines."""


def test_figures_of_a_phone_fill_the_panel_of_the_window_that_grew(page: Any) -> None:
    """They kept the phone's width, and their legends stood where they had been."""
    page.set_viewport_size({"width": 390, "height": 844})
    page.wait_for_function("innerWidth === 390 && document.getElementById('fx-links')")
    page.locator("#fx-links button").last.click()
    page.wait_for_function("document.querySelector('.js-plotly-plot')?.clientWidth < 390")
    page.set_viewport_size({"width": int(NARROW), "height": 800})
    page.wait_for_function(FILLED, arg=400)
    page.set_viewport_size(SIZE)


NAMES = """([html, width]) => {
  const panel = document.body.appendChild(document.createElement("div"));
  panel.className = "fx";
  panel.style.width = `${width}px`;
  panel.innerHTML = html;
  for (const details of panel.querySelectorAll("[data-fold=rest]")) details.open = true;
  const broken = [...panel.querySelectorAll(".candidate > b")].filter(
    name => name.getClientRects()[0].height > 1.8 * parseFloat(getComputedStyle(name).fontSize));
  const texts = broken.map(name => name.textContent);
  panel.remove();
  return texts;
}"""
USABLE = CONTROLS - 16.0
"""px of the controls beside the bar that scrolls them."""


def test_the_name_of_each_effect_stands_on_one_line_of_the_ranking(page: Any) -> None:
    known = [
        RankedEffect(kind, effect.title, 50.0, 1e-9, 70.0, share, 900.0)
        for share in (99.97, None)
        for kind, effect in catalogue().items()
    ]
    rows = [(one, sparkline(np.arange(9.0), np.arange(9.0), size=PICTURE), "") for one in known]
    html = str(WORDS.candidates(rows, known, False, {}, True, ""))
    assert len(known) > 30
    assert page.evaluate(NAMES, [html, USABLE]) == []


MARKS = """[...document.querySelectorAll(".uplot .u-series[data-mark]")].map(series => {
  const mark = getComputedStyle(series.querySelector(".u-marker"));
  return [series.dataset.mark, mark.borderTopStyle, parseFloat(mark.height)];
})"""


LINE = 2.0
"""px"""


def test_the_live_charts_have_the_legend_of_all_other_figures(page: Any) -> None:
    """A line, solid or dashed, instead of a square; title and legend stand above the lines."""
    page.wait_for_function(f"{MARKS}.length >= 8")
    marks = page.evaluate(MARKS)
    assert {mark[0] for mark in marks} >= {"solid", "dashed"}
    lines = [mark for mark in marks if mark[0] != "dots"]
    assert all(name == style and height <= LINE for name, style, height in lines), marks
    tops = """[...document.querySelectorAll(".uplot")].map(chart =>
      [".u-title", ".u-legend", ".u-wrap"].map(
        part => chart.querySelector(part).getBoundingClientRect().top))"""
    assert all(edges == sorted(edges) for edges in page.evaluate(tops))
