"""The moment in a browser: a figure that moves from what it was to what it is."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

pytestmark = pytest.mark.long

DRAW = """async level => {
  const node = window.fxTest ??= document.body.appendChild(document.createElement('div'));
  const layout = {width: 300, height: 200, meta: {morph: true}, yaxis: {range: [-3, 3]}};
  const data = [{type: 'scatter', name: 'dots', x: [0, 1, 2], y: [level, level, level]}];
  await window.Plotly.react(node, data, layout, {});
  return node._fullData[0].y[1];
}"""
LASTS = 500.0
"""ms from what it was to what it is."""
HAND = """() => {
  let now = 0, frames = [];
  performance.now = () => now;
  window.requestAnimationFrame = frame => frames.push(frame);
  window.fxAfter = ms => {
    now = ms;
    for (const frame of frames.splice(0)) frame(now);
    return window.fxTest._fullData[0].y[1];
  };
}"""
"""Frames come by hand: a busy browser may draw none between the first and the last."""
READY = "window.fxPlots && window.Plotly && String(window.Plotly.react).includes('morph')"
"""What draws is wrapped."""


@pytest.fixture
def by_hand(page: Any) -> Iterator[Any]:
    """The page with frames by hand; no other test can use it afterwards."""
    page.wait_for_function(READY)
    page.evaluate(HAND)
    yield page
    page.goto("about:blank")


def test_the_dots_move_to_what_is_left(by_hand: Any) -> None:
    assert by_hand.evaluate(DRAW, 2.0) == 2.0
    assert by_hand.evaluate(DRAW, 0.0) == 2.0, "it begins where it was"
    after = "ms => window.fxAfter(ms)"
    places = [by_hand.evaluate(after, share * LASTS) for share in (0.25, 0.5, 0.75, 1.0, 2.0)]
    assert places == sorted(places, reverse=True)
    assert places[1] == pytest.approx(1.0) and places[-2:] == [0.0, 0.0]


BARS = """async errors => {
  const node = window.fxTest ??= document.body.appendChild(document.createElement('div'));
  const layout = {width: 300, height: 200, meta: {morph: 'x'}, xaxis: {range: [0, 10]}};
  const rows = errors.map((_, k) => k);
  const data = [{type: 'bar', orientation: 'h', name: 'estimation', x: errors, y: rows}];
  await window.Plotly.react(node, data, layout, {});
  return [...node._fullData[0].x];
}"""


def test_a_new_bar_falls_from_the_error_before(by_hand: Any) -> None:
    assert by_hand.evaluate(BARS, [9.0]) == [9.0]
    assert by_hand.evaluate(BARS, [9.0, 0.5]) == [9.0, 9.0], "it begins where the last one ends"
    by_hand.evaluate("ms => window.fxAfter(ms)", 2.0 * LASTS)
    assert by_hand.evaluate("[...window.fxTest._fullData[0].x]") == [9.0, 0.5]


def test_who_asked_for_calm_gets_it(page: Any) -> None:
    page.emulate_media(reduced_motion="reduce")
    page.wait_for_function(READY)
    page.evaluate(DRAW, 2.0)
    assert page.evaluate(DRAW, 0.0) == 0.0
