"""What lies over figures: the time-line's cursor, which moves without a figure being sent again,
and the marks A and B, between which a person measures."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from flexgui.core.errors import InputError
from flexgui.library.shipped import demo_scenario
from flexgui.session import playback
from flexgui.session.session import Session
from flexgui.stages.compare.panel import OWN
from tests.page.helpers import LOOK, pick, press, sees
from tests.page.test_diagnose import few
from tests.session.helpers import until

pytestmark = pytest.mark.long

AT = """() => [...document.querySelectorAll('.js-plotly-plot')].flatMap(node => {
  const line = node.querySelector('.fx-at.cursor');
  if (!line || !node.offsetParent) return [];
  const box = line.getBoundingClientRect(), own = node.getBoundingClientRect();
  const axis = node._fullLayout.xaxis;
  const middle = 0.5 * (box.left + box.right) - own.left - axis._offset;
  return [[axis.p2l(middle), node.layout.meta.cursor]];
})"""
"""Time in s at which each figure's line stands, and the key of the figure."""
RANGE = """[...document.querySelectorAll('.js-plotly-plot')].find(node => node.offsetParent)
  ._fullLayout.xaxis.range"""
ZOOM = """range => window.Plotly.relayout([...document.querySelectorAll('.js-plotly-plot')]
  .find(node => node.offsetParent), {'xaxis.range': range})"""
APART = 500
"""ms between two clicks that are no double click."""
SEEN = 0.02
"""s, a pixel or two of a figure over two or three seconds."""


def test_the_line_moves_and_the_figure_stays(page: Any, session: Session) -> None:
    press(page, "Data")
    until(lambda: session.playback.motion is not None and page.evaluate(AT))
    before = page.evaluate(AT)
    for time in (0.5, 1.25):
        session.playback.move(time=time)
        until(lambda time=time: np.isclose(page.evaluate(AT)[0][0], time, atol=SEEN))  # type: ignore[misc]
    assert [key for _, key in page.evaluate(AT)] == [key for _, key in before]
    page.set_viewport_size({"width": 1200, "height": 800})
    until(lambda: np.isclose(page.evaluate(AT)[0][0], 1.25, atol=SEEN))
    page.evaluate(ZOOM, [1.0, 1.5])
    until(lambda: np.isclose(page.evaluate(AT)[0][0], 1.25, atol=SEEN))
    session.playback.move(time=1.4)
    until(lambda: np.isclose(page.evaluate(AT)[0][0], 1.4, atol=SEEN))
    session.playback.move(time=0.5)
    until(lambda: not page.evaluate(AT))  # beside what is seen


def test_a_click_moves_the_time_line_there(page: Any, session: Session) -> None:
    press(page, "Data")
    until(lambda: session.playback.motion is not None and page.evaluate(AT))
    box = page.locator(".js-plotly-plot:visible .nsewdrag").first.bounding_box()
    low, high = page.evaluate(RANGE)
    page.mouse.click(box["x"] + 0.4 * box["width"], box["y"] + 0.5 * box["height"])
    clicked = low + 0.4 * (high - low)
    until(lambda: np.isclose(session.playback.cursor.time, clicked, atol=SEEN))
    assert not page.evaluate("document.querySelectorAll('.fx-at:is(.A, .B)').length")


def test_two_clicks_with_shift_measure_between_two_times_and_escape_forgets_them(
    page: Any, session: Session
) -> None:
    press(page, "Data")
    until(lambda: session.playback.motion is not None and page.evaluate(AT))
    box = page.locator(".js-plotly-plot:visible .nsewdrag").first.bounding_box()
    read = page.locator(".fx-measured")
    page.keyboard.down("Shift")
    for share in (0.25, 0.5):
        page.mouse.click(box["x"] + share * box["width"], box["y"] + 0.5 * box["height"])
        page.wait_for_timeout(APART)
    page.keyboard.up("Shift")
    first, last = (
        float(read.locator("tr").nth(1).locator("td").nth(k).inner_text()) for k in (1, 2)
    )
    low, high = page.evaluate(RANGE)
    assert (first - low) / (high - low) == pytest.approx(0.25, abs=0.01)
    assert (last - low) / (high - low) == pytest.approx(0.5, abs=0.01)
    for row in read.locator("tr").all()[1:]:
        texts = row.locator("td").all_inner_texts()[1:]
        a, b, difference = (float(text.replace("−", "-")) for text in texts)
        assert difference == pytest.approx(b - a, rel=0.01, abs=1e-3 * max(abs(a), abs(b)))
    page.keyboard.press("Escape")
    read.wait_for(state="detached")
    assert not page.evaluate("document.querySelectorAll('.fx-at:is(.A, .B)').length")


def test_a_recording_that_is_not_read_yet_is_told_and_read_at_the_next_stage(
    page: Any, session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    def late(*_: Any) -> None:
        raise InputError("The worker was stopped.")

    press(page, "Diagnose")
    with monkeypatch.context() as patched:
        patched.setattr(playback.recorded_motion, "read_recording", late)
        assert session.open(demo_scenario())
        sees(page, "The worker was stopped.")
        sees(page, "The recording is not read yet")
    press(page, "Data")
    sees(page, "model as stated")


def test_picked_signals_stand_in_one_plot_and_stay_with_the_work(
    page: Any, session: Session
) -> None:
    few(session)
    assert session.identification.start()
    until(lambda: not session.run.busy)
    press(page, "Compare")
    pick(page, "Show", OWN)
    for title in ("θ₁ measured", "θ₁ model", "z₁ residual"):
        page.get_by_role("checkbox", name=title).click()
        page.locator(".tick[aria-checked=true]", has_text=title).wait_for()
    assert session.comparison.picked == ("theta1/measured", "theta1/model", "z1/residual")
    names = """[...document.querySelectorAll('.js-plotly-plot')].filter(n => n.offsetParent)
      .flatMap(n => n.data.map(trace => trace.name)).join()"""
    until(lambda: page.evaluate(names) == "θ₁ measured,θ₁ model,z₁ residual")
    assert session.comparison.view == OWN


CELL = """([row, column]) => {
  const node = [...document.querySelectorAll('.js-plotly-plot')]
    .find(node => node.offsetParent && node.data.some(trace => trace.type === 'heatmap'));
  const {xaxis, yaxis} = node._fullLayout, box = node.getBoundingClientRect();
  const {x} = node._fullData[0], time = 0.5 * (x[column] + x[column + 1]);
  const across = xaxis._offset + xaxis.l2p(time), down = yaxis._offset + yaxis.l2p(row);
  return [box.left + across, box.top + down, time];
}"""
"""Where on the screen the middle of a cell of the error map is, and its time in s."""


def test_a_click_on_a_cell_of_the_error_map_leads_there(page: Any, session: Session) -> None:
    few(session)
    assert session.identification.start()
    until(lambda: not session.run.busy)
    press(page, "Compare")
    page.locator(".heatmaplayer image").first.wait_for()
    page.wait_for_timeout(LOOK)
    x, y, time = page.evaluate(CELL, [1, 4])
    page.mouse.click(x, y)
    names = [r.recording for r in session.comparison.shown]
    until(lambda: session.playback.cursor.recording == names[1])
    assert session.playback.cursor.time == pytest.approx(time)
    assert not page.evaluate("document.querySelectorAll('.fx-at:is(.A, .B)').length")
