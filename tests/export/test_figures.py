"""Figures of a page, as they leave and as a browser draws them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from markupsafe import Markup
from plotly.offline import get_plotlyjs

from flexgui.export.figures import Figures, Plot, plot
from flexgui.export.plotly_js import with_traces
from flexgui.export.template import environment
from flexgui.views.layout import Figure, axis, figure, heat, line

TIME = np.arange(3000) * 1e-3
"""s"""
WAVE = np.where(np.abs(TIME - 1.0) < 0.1, np.nan, 0.3 + np.sin(9.0 * TIME)).astype(np.float32)
MAP = np.array([[1.0, np.nan, 3.0], [4.0, 5.0, 60.0]])
DECAY = np.logspace(3, -9, 50)
DRAWN = 30_000
"""ms"""


def shown() -> list[Plot]:
    bars = {"type": "bar", "x": ["a", "b"], "y": [2, 3]}
    drawn = [
        figure([line(TIME, WAVE, "wave", "#123456")], axis("t"), axis("y")),
        figure([heat(MAP, [(0.0, "#000"), (1.0, "#fff")], "error")], axis(), axis()),
        figure([bars], axis(), axis()),
        figure([line(TIME[:50], DECAY, "cost", "#123456")], axis(), axis(type="log")),
        figure([line([0.0, 1.0], np.full(2, 7.0), "", "#123456")], axis(), axis()),
    ]
    return [p for f in drawn if (p := plot(f)) is not None]


def page_of(plots: list[Plot], path: Path) -> Path:
    """A page of its own with the macros of the reports."""
    text = (
        '{% from "parts.html.j2" import figure, scripts with context %}<nav></nav><main>'
        '{% for plot in plots %}{{ figure(plot, "x") }}{% endfor %}</main>{{ scripts() }}'
    )
    html = environment().from_string(text).render(plots=plots, figures=Figures())
    path.write_text(html, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def drawn(chromium: Any, tmp_path_factory: pytest.TempPathFactory) -> list[Figure]:
    """Data of each figure, from a browser that has drawn them all."""
    path = page_of(shown(), tmp_path_factory.mktemp("figures") / "page.html")
    page, errors = chromium.new_page(), []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(path.as_uri())
    page.wait_for_function(
        "() => [...document.querySelectorAll('.plot')].every((b) => b.querySelector('.main-svg'))",
        timeout=DRAWN,
    )
    script = """() => [...document.querySelectorAll('.plot')].map((box) => JSON.stringify(
        box.data[0], (key, value) => ArrayBuffer.isView(value) ? [...value] : value))"""
    texts = page.evaluate(script)
    page.close()
    assert errors == []
    return [json.loads(text) for text in texts]


def values(part: Any) -> np.ndarray:
    return np.array(part, dtype=float)


def test_times_arrive_exactly_and_values_to_a_hundredth_of_a_pixel(drawn: list[Figure]) -> None:
    np.testing.assert_allclose(values(drawn[0]["x"]), TIME, rtol=1e-6)
    span = np.nanmax(WAVE) - np.nanmin(WAVE)
    np.testing.assert_allclose(values(drawn[0]["y"]), WAVE, atol=span / 1e5)


def test_maps_bars_and_constants_arrive(drawn: list[Figure]) -> None:
    np.testing.assert_allclose(values(drawn[1]["z"]), MAP, atol=1e-3)
    assert drawn[2]["y"] == [2, 3]
    assert drawn[4]["y"] == [7.0, 7.0]


def test_small_values_of_many_decades_arrive_to_float32(drawn: list[Figure]) -> None:
    np.testing.assert_allclose(values(drawn[3]["y"]), DECAY, rtol=1e-6)


def test_figures_take_a_quarter_of_their_float32() -> None:
    figures = Figures()
    figures.add(shown()[0])
    assert len(figures.packed()) < 4 * (TIME.size + WAVE.size) / 4


@pytest.mark.parametrize("kinds", [{"scatter3d"}, {"pie", "bar"}])
def test_plotly_holds_what_is_drawn(kinds: set[str]) -> None:
    whole = get_plotlyjs()
    cut = with_traces(whole, kinds)
    assert 0.15 < len(cut) / len(whole) < 0.9
    assert all(f'name:"{kind}"' in cut for kind in kinds)
    assert with_traces(whole, {*kinds, "no such kind"}) == whole


def test_a_script_of_another_form_is_left_as_it_is() -> None:
    assert with_traces("var Plotly = {};", {"bar"}) == "var Plotly = {};"


def test_text_of_a_figure_cannot_leave_its_script() -> None:
    figures = Figures()
    figures.add(Plot({"data": [], "layout": {"title": {"text": "</script><b>"}}}, 1, ""))
    assert isinstance(figures.packed(), Markup) and "<" not in figures.packed()
