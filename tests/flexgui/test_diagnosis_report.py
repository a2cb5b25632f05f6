"""Figures and tables about a diagnosis, and its report on paper."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flexgui.core.error_maps import error_maps
from flexgui.core.results import Outcome
from flexgui.core.results.comparison import DIAGNOSIS_FIT
from flexgui.views.error_map import cell_labels, error_map, place, row_labels, worst_table
from flexgui.views.ladder import NO_VALIDATION, UNSEEN, ladder, step_labels
from flexgui.views.missing_torque import residual_over
from flexgui.views.ranking import LEAST_SEEN, ranking, ranking_table
from flexgui.views.summary import diagnosis_frees_starts, which_fit, which_fit_in_report
from tests.export.helpers import figure_text
from tests.flexgui.findings import FLOORS, FOUND, RANKING, ranked, step

Exported = Callable[[str], Path]

MOST_PAGES = 10
PRINTED = """() => ({
  folded: document.querySelectorAll("details:not([open])").length,
  undrawn: document.querySelectorAll(".plot:not(:has(.main-svg))").length,
  narrow: [...document.querySelectorAll(".plot")].map(p => {
    const place = p.closest(".figures > *") ?? p.closest("section");
    return p.getBoundingClientRect().width / place.clientWidth; }).filter(share => share < 0.95),
  over: [...document.querySelectorAll("table, .plot, math, p")]
    .filter(one => one.getBoundingClientRect().right > innerWidth + 1).length,
  overprinted: [...document.querySelectorAll(".plot .yaxislayer-above")].filter(axis => {
    const rows = [...axis.querySelectorAll("text")].map(t => t.getBoundingClientRect());
    rows.sort((a, b) => a.top - b.top);
    return rows.some((row, k) => k && row.top + 0.25 * row.height < rows[k - 1].bottom
      && row.left < rows[k - 1].right) && axis.closest("#fit"); }).length,
})"""


@pytest.mark.long
def test_on_a4_it_takes_ten_pages_unfolded_and_as_wide_as_the_paper(
    exported: Exported, chromium: Any
) -> None:
    page = chromium.new_page(viewport={"width": 702, "height": 1000})
    page.goto((exported("diagnosed") / "report.html").as_uri())
    page.locator(".js-plotly-plot").first.wait_for()
    assert len(re.findall(rb"/Type\s*/Page\b", page.pdf(prefer_css_page_size=True))) <= MOST_PAGES
    page.emulate_media(media="print")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert page.evaluate(PRINTED) == {
        "folded": 0,
        "undrawn": 0,
        "narrow": [],
        "over": 0,
        "overprinted": 0,
    }
    page.emulate_media(media="screen")
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert page.locator("details:not([open])").count() > 0, "what was folded is folded again"
    page.close()


def test_it_opens_with_tables_and_draws_the_ladder_once(exported: Exported) -> None:
    page = (exported("diagnosed") / "report.html").read_text("utf-8")
    first = page.split('id="diagnosis"')[0]
    summary = re.search(r'<p class="summary">(.*?)</p>', first)
    assert summary is not None and len(re.findall(r"\d+", summary[1])) < 5
    assert first.count("<table>") >= 2
    assert figure_text(page).count("noise floor, shaded]") == 1


def test_words_are_text_and_never_markup(exported: Exported) -> None:
    text = (exported("diagnosed") / "report.html").read_text("utf-8")
    assert "<script>alert" not in text
    assert "&lt;script&gt;alert(1)&lt;/script&gt; the friction" in text


def test_bars_end_at_the_error_and_one_at_the_floor_is_seen() -> None:
    figure = ladder(FOUND.steps)
    assert figure is not None
    estimation, validation = figure["data"][:2]
    begin = estimation["base"]
    assert begin == validation["base"] == 10.0 ** figure["layout"]["xaxis"]["range"][0] < 1.0
    assert [begin + x for x in estimation["x"]] == pytest.approx([9.0, 1.0])
    assert [begin + x for x in validation["x"]] == pytest.approx([9.5, 1.1])
    assert figure["layout"]["xaxis"]["type"] == "log"


def test_without_validation_one_bar_stands_and_the_caption_says_so() -> None:
    alone = [
        replace(s, errors=tuple(replace(e, validation_rms=float("nan")) for e in s.errors))
        for s in FOUND.steps
    ]
    figure = ladder(alone)
    assert figure is not None
    assert [t["name"] for t in figure["data"] if t["type"] == "bar"] == ["estimation"]
    assert NO_VALIDATION in figure["layout"]["meta"]["caption"]
    some = ladder([alone[0], FOUND.steps[1]])
    assert some is not None and some["data"][1]["text"][0] == UNSEEN
    assert ladder(()) is None


def test_steps_with_the_same_effect_have_labels_of_their_own() -> None:
    twice = [step("a", "Extra mode", 1.0, 1.0)] * 2
    labels = step_labels([FOUND.steps[0], *twice])
    assert labels == ["as given", "+ Extra mode", "+ Extra mode (2)"]


def test_errors_say_on_the_spot_which_fit_they_are_of(diagnosed: Outcome) -> None:
    theirs = tuple(replace(c, fit_label=DIAGNOSIS_FIT) for c in diagnosed.comparisons)
    fitted = replace(FOUND, parameters=RANKING[0].parameters)
    told = which_fit_in_report(replace(diagnosed, diagnosis=fitted, comparisons=theirs)).unescape()
    assert "FIT and tip error above are of the diagnosis fit too." in told
    assert not which_fit_in_report(replace(diagnosed, diagnosis=None))
    assert which_fit(diagnosed.comparisons, diagnosed.fits).startswith("Identification fit: ")
    assert which_fit(theirs, diagnosed.fits).startswith("Diagnosis fit: ")
    assert "also fits the initial state of each recording" in which_fit(theirs, diagnosed.fits)


def test_where_a_servo_follows_the_encoders_no_start_is_said_to_be_fitted() -> None:
    assert diagnosis_frees_starts(["z1", "theta1"], ())
    assert not diagnosis_frees_starts(["u1"], ())


def test_the_ranking_marks_what_was_added_and_names_its_rivals() -> None:
    table = ranking_table(RANKING, "coulomb_friction")
    assert [r.strong for r in table.rows] == [True, False, False]
    assert "f<sub>c1</sub> = 1.200" in table.rows[0].cells[-1]
    larger = ranked("stribeck_friction", "Stribeck friction", 99.99)
    table = ranking_table((RANKING[0], larger), "coulomb_friction")
    assert "contains Coulomb friction" in table.rows[1].cells
    assert table.rows[1].cells[1] == "> 99.9", "not all of it"
    told = ranking_table((larger, RANKING[0])).rows[1].cells
    assert "cannot be distinguished from viscous_friction; part of Stribeck friction" in told
    figure = ranking(RANKING, "coulomb_friction")
    assert figure is not None
    assert list(figure["data"][1]["x"]) == [97.0, 95.0, None]
    assert ranking(()) is None


def test_maps_share_their_colours_and_show_every_recording(diagnosed: Outcome) -> None:
    maps = error_maps(diagnosed.comparisons, FLOORS)
    for shown in (maps.by_frequency, maps.by_time):
        figure = error_map(shown)
        assert figure is not None
        assert len(figure["data"]) == len(FLOORS)
        assert len({(h["zmin"], h["zmax"]) for h in figure["data"]}) == 1
        assert figure["data"][0]["z"].shape == shown[0].rms.shape
        written = figure["data"][0]["text"][0][0]
        assert float(written) == pytest.approx(shown[0].ratio[0, 0], rel=0.05)
    assert error_map(()) is None
    chosen = maps.worst[0]
    figure = error_map([m for m in maps.by_time if m.channel == chosen.channel], chosen=chosen)
    assert figure is not None and len(figure["layout"]["meta"]["columns"]) == 13
    other = maps.by_frequency if chosen.axis == "frequency" else maps.by_time
    figure = error_map(other, chosen=chosen)
    assert figure is not None
    (outline,) = figure["layout"]["shapes"]
    shown = [m.channel for m in other]
    assert (
        outline["xref"]
        == f"x{shown.index(chosen.channel) + 1 if shown[0] != chosen.channel else ''}"
    )
    assert outline["y0"] + 0.5 == other[0].recordings.index(chosen.recording)
    assert row_labels(maps.by_time[0])[0] == "th1 (θ₂ 23°)"
    assert len(worst_table(maps.worst).rows) == 10
    assert re.fullmatch(r"[\d.]+ to [\d.]+ (s|Hz)", place(maps.worst[0]))
    assert cell_labels(np.array([0.0, 3.90625, 7.8125])) == ["0–3.9", "3.9–7.8"]


def test_patterns_are_drawn_for_both_directions(diagnosed: Outcome) -> None:
    maps = error_maps(diagnosed.comparisons, FLOORS)
    figure = residual_over(maps.over[:2])
    assert figure is not None
    lines = [t for t in figure["data"] if t["mode"] == "lines+markers"]
    assert [t["name"] for t in lines] == ["forwards", "backwards"] * 2
    assert residual_over(()) is None


def test_what_explains_nothing_is_in_no_list() -> None:
    none = replace(RANKING[1], refit_drop_percent=0.004)
    shown = (RANKING[0], none, RANKING[2])
    assert [row.cells[0] for row in ranking_table(shown).rows] == [
        "Coulomb friction",
        "Tip payload",
    ]
    assert "Not listed, as they explain nothing: 1." in ranking_table(shown).caption
    figure = ranking(shown)
    assert figure is not None and none.title not in figure["data"][0]["y"]
    assert ranking((none,)) is None
    little = replace(none, refit_drop_percent=None, expected_drop_percent=0.5 * LEAST_SEEN)
    assert ranking((little,)) is None, "bars that nobody sees make an empty figure"
