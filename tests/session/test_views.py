"""The figures and tables that only the page shows."""

from __future__ import annotations

import json

import numpy as np
import pytest
from markupsafe import Markup

from flexgui.core.recording.recording import Recording
from flexgui.core.results import Equation, Estimate, Fit, Generation, Identifiability
from flexgui.views.convergence import (
    LIVE_POINTS,
    Searched,
    live_convergence,
    live_parameters,
    live_plane,
)
from flexgui.views.layout import figure_json
from flexgui.views.parameter_tables import GLOCAL, MEAN, SNR_20, SNR_NONE, paper_table
from flexgui.views.preview import ROWS, preview
from flexgui.views.table import Column, Row, Table, html_equations, html_table

SEARCHED = (
    Searched("epsilon", r"\varepsilon", "Pa", 0.8e9, 1.2e9),
    Searched("d", "d", "m", 0.04, 0.06),
)
LAST_DIGIT = 1e-4
"""GPa: the paper prints four digits of ε, and cuts one of its means instead of rounding it."""


def history(count: int = 5) -> dict[str, tuple[Generation, ...]]:
    rng = np.random.default_rng(1)
    best = np.array([1.1e9, 0.0488])
    members = np.column_stack([rng.uniform(0.8e9, 1.2e9, 9), rng.uniform(0.04, 0.06, 9)])
    told = [Generation(k, 1.0 / (k + 1), 2.0, 3.0, best, members) for k in range(count)]
    return {"all recordings": tuple(told)}


def fit(label: str, eps: float) -> Fit:
    estimates = (
        Estimate("epsilon", eps, np.nan, "Pa", False),
        Estimate("d", 0.05, np.nan, "m", False),
    )
    derived = (Estimate("EI", 520.0, 0.5, "N m²", True),)
    known = Identifiability(("epsilon", "d"), 1, np.ones(2), np.zeros((1, 2)))
    return Fit(label, (label,), estimates, np.eye(2), 1.0, 10, (), known, 0.0, derived=derived)


def test_the_valley_goes_through_the_best_member() -> None:
    figure = live_plane(history(), SEARCHED)
    assert figure is not None
    valley = next(t for t in figure["data"] if "valley" in t["name"])
    eps, d = np.array(valley["x"]) * 1e9, np.array(valley["y"]) * 1e-3
    assert eps * d**4 == pytest.approx(1.1e9 * 0.0488**4, rel=1e-4)


def test_one_parameter_has_no_plane() -> None:
    assert live_plane(history(), SEARCHED[:1]) is None


def test_figures_of_a_search_are_plain_json() -> None:
    for figure in (live_convergence(history()), live_plane(history(), SEARCHED)):
        assert json.loads(figure_json(figure))["data"]


@pytest.mark.parametrize("count", [1, LIVE_POINTS, LIVE_POINTS + 1, 2928, 10_000])
def test_a_long_search_is_drawn_with_few_points_and_its_newest(count: int) -> None:
    for trace in live_convergence(history(count))["data"]:
        assert LIVE_POINTS / 2 <= len(trace["x"]) <= LIVE_POINTS or len(trace["x"]) == count
        assert trace["x"][-1] == count - 1


def test_parameters_so_far_have_a_row_each() -> None:
    table = live_parameters(history(), SEARCHED)
    assert table is not None and len(table.rows) == 2
    assert live_parameters({}, SEARCHED) is None


def test_the_papers_local_means_are_the_means_of_its_rows() -> None:
    for told in (SNR_NONE, SNR_20):
        rows = np.array(told)
        assert rows[:MEAN, 0].mean() == pytest.approx(rows[MEAN, 0], abs=LAST_DIGIT)


def test_a_glocal_result_stands_in_its_row_only() -> None:
    table = paper_table([fit("all", 1.01e9)], (), noisy=True)
    filled = [k for k, row in enumerate(table.rows) if row.strong]
    assert filled == [GLOCAL]
    assert table.rows[GLOCAL].cells[2] == "1.0100"


def test_local_results_stand_at_their_working_points_with_their_mean() -> None:
    fits = [fit("a", 0.9e9), fit("b", 1.1e9)]
    table = paper_table(fits, (np.pi / 4, 3 * np.pi / 8), noisy=False)
    assert [k for k, row in enumerate(table.rows) if row.strong] == [1, 2, MEAN]
    assert table.rows[MEAN].cells[2] == "1.0000"


def test_preview_fits_the_panel_and_shades_what_does_not_count() -> None:
    time = np.arange(1000) * 1e-3
    names = ("dtheta1_ref", "u1", "theta1", "z1", "ydot1", "y1", "deflection1")
    counted = {"z1": (time < 0.2) | (time > 0.4)}
    recording = Recording("r", time, {n: np.sin(9 * time) for n in names}, counted=counted)
    figure = preview(recording)
    rows = [k for k in figure["layout"] if k.startswith("yaxis")]
    assert len(rows) == ROWS
    (band,) = figure["layout"]["shapes"]
    assert (band["x0"], band["x1"]) == pytest.approx((0.2, 0.4), abs=2e-3)


def test_a_slide_is_previewed_in_metres() -> None:
    time = np.arange(100) * 1e-2
    recording = Recording("r", time, {"theta1": time})
    assert "[m]" in preview(recording, [True])["layout"]["yaxis"]["title"]["text"]
    assert "[rad]" in preview(recording)["layout"]["yaxis"]["title"]["text"]


def test_html_escapes_every_text() -> None:
    evil = "<img src=x onerror=alert(1)>"
    table = Table((Column(evil),), (Row((evil,)),), evil)
    page = html_table(table) + html_equations([Equation(evil, rf"\text{{{evil}}}", evil)])
    assert isinstance(page, Markup)
    assert "<img" not in page
