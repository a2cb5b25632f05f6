"""The moment in a browser: a figure that moves from what it was to what it is."""

from __future__ import annotations

from typing import Any

DRAW = """async level => {
  const node = window.fxTest ??= document.body.appendChild(document.createElement('div'));
  const layout = {width: 300, height: 200, meta: {morph: true}, yaxis: {range: [-3, 3]}};
  const data = [{type: 'scatter', name: 'dots', x: [0, 1, 2], y: [level, level, level]}];
  await window.Plotly.react(node, data, layout, {});
  return node._fullData[0].y[1];
}"""
NOW = "window.fxTest._fullData[0].y[1]"


def test_the_dots_move_to_what_is_left(page: Any) -> None:
    page.wait_for_function("window.fxPlots && window.Plotly")
    page.wait_for_timeout(100)  # the page wraps what draws at its next look
    assert page.evaluate(DRAW, 2.0) == 2.0
    assert page.evaluate(DRAW, 0.0) > 1.0, "it begins where it was"
    page.wait_for_function(f"{NOW} > 0.1 && {NOW} < 1.9")
    page.wait_for_function(f"{NOW} === 0")


def test_who_asked_for_calm_gets_it(page: Any) -> None:
    page.emulate_media(reduced_motion="reduce")
    page.wait_for_function("window.fxPlots && window.Plotly")
    page.wait_for_timeout(100)
    page.evaluate(DRAW, 2.0)
    assert page.evaluate(DRAW, 0.0) == 0.0
