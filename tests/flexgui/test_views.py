"""Each view is a pure function whose axes carry units; lines, formulas and colours in it."""

from __future__ import annotations

import copy
import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from plotly.offline import get_plotlyjs

from flexgui.core.results import ChannelComparison, Outcome, RecordingComparison
from flexgui.views import colours
from flexgui.views.comparison import comparison
from flexgui.views.convergence import convergence
from flexgui.views.error_map import error_now
from flexgui.views.fit_table import THE_AXIS, TICK_GAP, fit_dots, variants
from flexgui.views.identifiability import correlation, valley
from flexgui.views.ladder import ladder
from flexgui.views.layout import Figure, decimate, figure_json, number, trace
from flexgui.views.missing_torque import missing_over_time, missing_over_velocity
from flexgui.views.parameter_tables import parameters
from flexgui.views.pooled import tip_rms
from flexgui.views.ranking import ranking
from flexgui.views.summary import alarms
from flexgui.views.table import ALLOWED, NAMESPACE, mathml
from tests.flexgui.findings import FOUND, RANKING

LEAST_CONTRAST = 3.0
"""Of lines against their ground, WCAG 2.2, 1.4.11."""

FIGURES: dict[str, Callable[[Outcome], Figure | None]] = {
    "comparison": lambda o: comparison(o.comparisons[0]),
    "convergence": lambda o: convergence(o.fits),
    "correlation": lambda o: correlation(o.fits[0]),
    "fit_dots": lambda o: fit_dots(o.comparisons),
    "valley": lambda o: valley(o.fits),
    "missing_over_time": lambda o: missing_over_time(o.comparisons[0].missing_torque),
    "missing_over_velocity": lambda o: missing_over_velocity(o.comparisons[0].missing_torque),
}
DRAW = "f => Plotly.newPlot(document.body, f.data, f.layout)"
UNITLESS = {"parameter", "recording"}


def test_plotly_draws_every_figure_without_a_word(chromium: Any, glocal: Outcome) -> None:
    beside = ("other", FOUND.steps[-1])
    figures = {name: draw(glocal) for name, draw in FIGURES.items()} | {
        "ladder": ladder(FOUND.steps, beside),
        "ranking": ranking(RANKING),
    }
    page, said = chromium.new_page(), list[str]()
    page.on("console", lambda message: said.append(message.text))
    page.add_script_tag(content=get_plotlyjs())
    for name, drawn in figures.items():
        said.append(name)
        page.evaluate(DRAW, json.loads(figure_json(drawn)))
    page.close()
    assert said == list(figures), "such as: Invalid color specifier"


@pytest.mark.parametrize("name", FIGURES)
def test_axes_carry_units_and_figures_a_caption(name: str, glocal: Outcome) -> None:
    layout = FIGURES[name](glocal)["layout"]
    titled = [
        axis["title"]["text"]
        for key, axis in layout.items()
        if key[1:5] == "axis" and axis.get("title", {}).get("text")
    ]
    assert titled
    for text in titled:
        assert text in UNITLESS or re.search(r"\[.+\]$", text), text
    assert layout["meta"]["caption"].endswith(".")
    assert layout["paper_bgcolor"] == colours.CLEAR


@pytest.mark.parametrize("name", FIGURES)
def test_views_are_pure(name: str, glocal: Outcome) -> None:
    before = copy.deepcopy(glocal.comparisons[0].channels[0].measured)
    first, second = (figure_json(FIGURES[name](glocal)) for _ in range(2))
    assert first == second
    np.testing.assert_array_equal(before, glocal.comparisons[0].channels[0].measured)


def test_long_traces_are_thinned_and_the_caption_says_so(glocal: Outcome) -> None:
    figure = comparison(glocal.comparisons[0])
    assert max(len(t["x"]) for t in figure["data"]) < 2100
    assert "2000 points" in figure["layout"]["meta"]["caption"]
    titles = [each["title"]["text"] for key, each in figure["layout"].items() if key[:5] == "yaxis"]
    assert "Δz₁ [mm]" in titles, "small residuals read in small units"


def test_nothing_to_show_gives_no_figure(bare: Outcome) -> None:
    assert convergence(bare.fits) is None
    assert valley(bare.fits) is None
    assert fit_dots(bare.comparisons) is None
    assert variants(bare) is None


def test_first_states_of_recordings_stand_in_no_table_and_no_map(glocal: Outcome) -> None:
    fit = glocal.fits[0]
    start = replace(fit.estimates[0], name="start_v1_1", recording="r1")
    p = len(fit.estimates) + 1
    with_starts = replace(fit, estimates=(*fit.estimates, start), correlation=np.eye(p))
    table, before = parameters([with_starts]), parameters(glocal.fits)
    assert table.columns == before.columns and len(table.rows) == len(before.rows)
    assert "parameters.csv" in table.caption and "parameters.csv" not in before.caption
    figure = correlation(with_starts)
    assert figure is not None and np.shape(figure["data"][0]["z"]) == (p - 1, p - 1)


def test_dots_of_good_models_differ_and_have_their_numbers(glocal: Outcome) -> None:
    figure = fit_dots(glocal.comparisons)
    assert figure is not None and figure["layout"]["xaxis"]["type"] == "log"
    first = glocal.comparisons[0].channels[0]
    numbers, estimated, validated = figure["data"][:3]
    assert numbers["text"][0] == f"{first.fit_percent:.2f}"
    assert estimated["x"][0] == pytest.approx(100.0 - first.fit_percent)
    assert estimated["marker"]["symbol"] != validated["marker"]["symbol"]
    rows = len(glocal.comparisons)
    assert len(estimated["y"]) + len(validated["y"]) == len(numbers["y"]) == rows


def test_six_outputs_stand_in_two_rows_with_readable_axes(glocal: Outcome) -> None:
    """In one row their axes had room for two numbers that touched."""
    first = glocal.comparisons[0]
    six = [replace(first.channels[0], channel=f"y{k + 1}") for k in range(6)]
    layout = fit_dots([replace(first, channels=tuple(six))])["layout"]
    domains = {tuple(layout[f"yaxis{number(k)}"]["domain"]) for k in range(6)}
    assert len(domains) == 2
    shown = layout["xaxis"]
    begin, end = np.log10([shown["tickvals"][0], shown["tickvals"][-1]])
    apart = -np.diff(np.log10(shown["tickvals"])) / (begin - end)
    assert apart.min() >= TICK_GAP and len(shown["ticktext"]) <= 3
    assert layout["xaxis5"]["title"]["text"] == THE_AXIS
    assert len(layout["annotations"]) == 6, "the name of each output"


def test_the_noise_lies_around_the_residual(glocal: Outcome) -> None:
    one = glocal.comparisons[0]
    name = one.channels[0].channel
    bands = [t for t in comparison(one, floors={name: 2e-3})["data"] if t.get("fill") == "toself"]
    assert len(bands) == 1 and bands[0]["hoverinfo"] == "skip"
    assert max(bands[0]["y"]) == -min(bands[0]["y"]) > 0.0


def test_a_value_at_its_bound_and_a_model_that_explains_nothing_raise_an_alarm(
    glocal: Outcome,
) -> None:
    assert not alarms(glocal)
    fit = glocal.fits[0]
    stuck = tuple(replace(e, at_bound=e.name == "lambda1") for e in fit.estimates)
    flat = tuple(
        replace(r, channels=tuple(replace(c, model=0.0 * c.model) for c in r.channels))
        for r in glocal.comparisons
    )
    fits = (replace(fit, estimates=stuck),)
    found = alarms(replace(glocal, fits=fits, comparisons=flat, findings=("th1, z1: late.",)))
    assert any("λ₁ ended at a bound" in text for text in found)
    assert any("explains almost nothing of" in text for text in found)
    assert found[-1] == "th1, z1: late."


def test_the_better_model_is_marked(glocal: Outcome) -> None:
    table = variants(glocal)
    assert table is not None
    assert {row.best for row in table.rows} == {3}


def test_the_tip_error_is_weighted_by_samples(glocal: Outcome) -> None:
    one, two = glocal.comparisons[:2]
    assert tip_rms([]) is None
    assert tip_rms([replace(one, tip_rms=None)]) is None
    value = tip_rms([one, two])
    assert value == pytest.approx(np.sqrt((one.tip_rms**2 + two.tip_rms**2) / 2))


def _luminance(colour: str) -> float:
    parts = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


@pytest.mark.parametrize("ground", ["#ffffff", "#14181d"])
def test_colours_are_readable_in_light_and_dark(ground: str) -> None:
    used = {colours.MEASURED, colours.MODEL, colours.RESIDUAL, colours.ADDED, colours.START,
            colours.BOUND, *colours.SERIES}  # fmt: skip
    for colour in used:
        dark, light = sorted((_luminance(colour), _luminance(ground)))
        assert (light + 0.05) / (dark + 0.05) >= LEAST_CONTRAST, colour


@given(st.integers(0, 9000), st.integers(0, 5), st.sampled_from([100, 2000]))
def test_extremes_survive_and_points_are_few(n: int, seed: int, points: int) -> None:
    rng = np.random.default_rng(seed)
    values = rng.normal(size=n)
    values[rng.random(n) < 0.2] = np.nan
    index = decimate(np.arange(n) * 1e-3, values, points)
    assert index.size <= points
    assert np.all(np.diff(index) > 0)
    assert np.all(np.isfinite(values[index]))
    if np.isfinite(values).any():
        assert values[index].max() == np.nanmax(values)
        assert values[index].min() == np.nanmin(values)


def test_a_line_breaks_where_samples_are_missing_for_long() -> None:
    time = np.arange(5000) * 1e-3
    values = np.sin(time)
    values[2000:2500] = np.nan
    x, y = trace(time, values)
    (gap,) = np.flatnonzero(np.isnan(y))
    assert x[gap - 1] < 2.0 + 1e-6
    assert x[gap + 1] > 2.5 - 1e-6
    camera = np.full(5000, np.nan)
    camera[::10] = np.sin(time[::10])
    _, y = trace(time, camera)
    assert y.size == 500 and np.isfinite(y).all(), "a slow camera draws one line"


@given(every=st.integers(1, 400), first=st.integers(0, 399))
def test_the_error_of_a_slow_camera_stays_between_its_samples(every: int, first: int) -> None:
    time, counted = np.arange(2000) * 1e-3, np.zeros(2000, dtype=bool)
    counted[first % every :: every] = True
    measured = np.where(counted, 3.0, np.nan)
    channel = ChannelComparison("z1", "m", time, measured, np.zeros(2000), counted)
    now = error_now(RecordingComparison("th1", "estimate", "", (channel,)), {"z1": 1.0})
    assert now is not None and now.parts["camera"] == pytest.approx(3.0)


FORMULAS = (
    r"M(q)\,\ddot{q} = F(q,\dot{q}) + G u",
    r"\begin{bmatrix} 0 & I \\ -K & -D \end{bmatrix}",
    r"\left[\begin{matrix}1 & 0\\0 & 1\end{matrix}\right]",
    r"\frac{1}{2}\int_0^{l} EI\,\delta''^2\,dx",
    r"\cos{\left(\theta_{2} \right)} < 1",
    r"\text{<script>alert(1)</script>}",
    r"\text{a \& b}",
)
HOSTILE = (r"\text{<script>alert(1)</script>}", r"<img src=x onerror=alert(1)>",
           r"\href{javascript:alert(1)}{x}", r"\style{background:url(x)}{y}",
           r"\class{a}{\text{</math><script>}}")  # fmt: skip


@pytest.mark.parametrize("latex", FORMULAS)
def test_formulas_become_well_formed_mathml(latex: str) -> None:
    root = ET.fromstring(mathml(latex))
    assert root.tag == f"{{{NAMESPACE}}}math"
    if "bmatrix" in latex:
        text = str(mathml(latex))
        assert 'class="square"' in text and "[" not in text, "without a mathematical font"


@pytest.mark.parametrize("latex", HOSTILE)
def test_formulas_carry_no_other_elements_and_no_links(latex: str) -> None:
    text = str(mathml(latex))
    assert "<script" not in text
    assert "<img" not in text
    for nothing in (r"\bad{", "}{", ""):
        ET.fromstring(mathml(nothing))
    for element in ET.fromstring(text).iter():
        assert element.tag == "code" or element.tag.split("}")[-1] in ALLOWED
        assert not set(element.attrib) & {"href", "style", "onerror", "src"}
