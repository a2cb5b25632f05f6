"""Figures of a page, as they leave and as a browser draws them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from plotly.offline import get_plotlyjs

from flexgui.export.figures import Figures
from flexgui.export.plotly_js import with_traces
from flexgui.export.template import environment
from flexgui.views.layout import axis, figure, heat, line

TIME = np.arange(3000) * 1e-3
"""s"""
WAVE = np.where(np.abs(TIME - 1.0) < 0.1, np.nan, 0.3 + np.sin(9.0 * TIME))
MAP = np.array([[1.0, np.nan, 3.0], [4.0, 5.0, 60.0]])
SHADES = [(0.0, "#000"), (1.0, "#fff")]
TRACES: dict[str, tuple[dict[str, Any], str, float, float]] = {
    "even times": (line(TIME, WAVE, "wave", "#123456"), "x", 1e-6, 0.0),
    "a line with a gap": (line(TIME, WAVE, "wave", "#123456"), "y", 0.0, 2e-5),
    "a map": (heat(MAP, SHADES, "error"), "z", 0.0, 1e-3),
    "bars": ({"type": "bar", "x": ["a", "b"], "y": [2, 3]}, "y", 0.0, 0.0),
    "decades": (line(TIME[:50], np.logspace(3, -9, 50), "cost", "#123456"), "y", 1e-6, 0.0),
    "a constant": (line([0.0, 1.0], np.full(2, 7.0), "", "#123456"), "y", 0.0, 0.0),
}
"""A trace, and to which relative and absolute error a key of it arrives."""
PAGE = (
    '{% from "parts.html.j2" import figure, scripts with context %}<nav></nav>'
    '{% for plot in plots %}{{ figure(plot, "") }}{% endfor %}{{ scripts() }}'
)
DRAWN = "() => [...document.querySelectorAll('.plot')].every((b) => b.querySelector('.main-svg'))"
DATA = """() => [...document.querySelectorAll('.plot')].map((box) => JSON.stringify(
    box.data[0], (key, value) => ArrayBuffer.isView(value) ? [...value] : value))"""


def test_a_browser_draws_what_was_given(chromium: Any, tmp_path: Path) -> None:
    plots = [figure([trace], axis(), axis(), name) for name, (trace, *_) in TRACES.items()]
    path = tmp_path / "page.html"
    text = environment().from_string(PAGE).render(plots=plots, figures=Figures())
    path.write_text(text, encoding="utf-8")
    page, errors = chromium.new_page(), []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(path.as_uri())
    page.wait_for_function(DRAWN)
    found = [json.loads(text) for text in page.evaluate(DATA)]
    page.close()
    assert errors == []
    for (trace, key, relative, absolute), drawn in zip(TRACES.values(), found, strict=True):
        values = np.array(drawn[key], dtype=float)
        np.testing.assert_allclose(values, trace[key], rtol=relative, atol=absolute)


def test_a_line_takes_less_than_half_of_its_float32_and_no_letter_of_html() -> None:
    figures = Figures()
    figures.add(figure([TRACES["even times"][0]], axis("<b>"), axis()))
    assert len(figures.packed()) < 0.4 * 4 * (TIME.size + WAVE.size)
    assert "<" not in figures.packed()


@pytest.mark.parametrize("kinds", [{"scatter3d"}, {"pie", "bar"}])
def test_plotly_holds_what_is_drawn(kinds: set[str]) -> None:
    whole = get_plotlyjs()
    cut = with_traces(whole, kinds)
    assert 0.15 < len(cut) / len(whole) < 0.9
    assert all(f'name:"{kind}"' in cut for kind in kinds)
    assert with_traces(whole, {*kinds, "no such kind"}) == whole
    assert with_traces("var Plotly = {};", kinds) == "var Plotly = {};"
