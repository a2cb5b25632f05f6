"""What report, result and tables say about a diagnosis, and its figures."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from flexgui.core.error_maps import error_maps
from flexgui.core.results import (
    ChannelError,
    Diagnosis,
    DiagnosisRound,
    Estimate,
    JointMotion,
    LadderStep,
    Outcome,
    PlannedExperiment,
    RankedEffect,
)
from flexgui.core.results.comparison import DIAGNOSIS_FIT
from flexgui.export.export_files import export_outcome
from flexgui.views.error_map import cell_labels, error_map, place, row_labels, worst_table
from flexgui.views.ladder import (
    NO_VALIDATION,
    UNSEEN,
    ladder,
    ladder_table,
    sizes_table,
    step_labels,
)
from flexgui.views.missing_torque import residual_over
from flexgui.views.ranking import LEAST_SEEN, ranking, ranking_table
from flexgui.views.summary import diagnosis_frees_starts, which_fit, which_fit_in_report
from tests.export.helpers import figure_text

FLOORS = {"ydot1": 2.4e-3, "ydot2": 2.5e-3}
NASTY = "<script>alert(1)</script> the friction"


def ranked(kind: str, title: str, fall: float | None, *confused: str) -> RankedEffect:
    size = Estimate("fc1", 1.2, 0.01, "N m", True, "f_{c1}")
    bic = None if fall is None else 40.0 * fall
    sizes = () if fall is None else (size,)
    return RankedEffect(kind, title, 90.0, 0.0, 60.0, fall, bic, confused, sizes)


def step(added: str | None, title: str, cost: float, validation: float) -> LadderStep:
    root = np.sqrt(cost)
    errors = tuple(ChannelError(n, "rad/s", root * f, f, validation * f) for n, f in FLOORS.items())
    return LadderStep(added, title, (), errors, 2e-4 * root, cost, (90.0, 91.0), (88.0, 87.0))


RANKING = (
    ranked("coulomb_friction", "Coulomb friction", 97.0, "viscous_friction"),
    ranked("viscous_friction", "Viscous joint friction", 95.0),
    ranked("tip_payload", "Tip payload", None),
)
PLANNED = PlannedExperiment({"theta2": 1.57}, "rad/s", 123.0, ("Friction", "Damping"))

FOUND = Diagnosis(
    verdict="missing",
    final_verdict="nothing_missing",
    rounds=(
        DiagnosisRound(RANKING, "coulomb_friction", experiments=(PLANNED,)),
        DiagnosisRound(RANKING[1:], None),
    ),
    steps=(
        step(None, "The model as given", 81.0, 9.5),
        step("coulomb_friction", "Coulomb friction", 1.0, 1.1),
    ),
    words=(NASTY, "What remains: nothing."),
    not_applicable={"large_motion": "The model is non-linear already."},
    effects=({"id": "coulomb_friction", "fc1": {"start": 1.2, "vary": True}},),
    floors=FLOORS,
    seconds={"base": 1.0, "diagnose": 2.0},
)


def motion(samples: int) -> JointMotion:
    """The error of the made-up recordings follows sin 40 t; so does the deflection here."""
    t = np.linspace(0.0, 3.0, samples)
    place = np.column_stack([np.sin(5 * t), np.cos(4 * t)])
    rate = np.gradient(place, t, axis=0)
    bent = 0.001 * np.column_stack([np.sin(40 * t), np.cos(40 * t)])
    return JointMotion(place, rate, np.gradient(rate, t, axis=0), bent, ("rad", "rad"))


@pytest.fixture(scope="module")
def diagnosed(glocal: Outcome) -> Outcome:
    moved = tuple(
        replace(r, motion=motion(len(r.channels[0].time)), theta2=0.4) for r in glocal.comparisons
    )
    seconds = {**glocal.seconds, "diagnose": 3.0}
    return replace(glocal, comparisons=moved, diagnosis=FOUND, seconds=seconds)


@pytest.fixture(scope="module")
def out(diagnosed: Outcome, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("diagnosed")
    export_outcome(diagnosed, "title = 'x'", folder)
    return folder


def test_the_result_keeps_the_contract(out: Path) -> None:
    result = json.loads((out / "result.json").read_text("utf-8"))
    assert (result["verdict"], result["final_verdict"]) == ("missing", "nothing_missing")
    assert [s["added"] for s in result["steps"]] == [None, "coulomb_friction"]
    for one in result["steps"]:
        assert {"tip_rms_m", "fit_percent", "validation_fit_percent", "parameters"} <= set(one)
        for error in one["errors"]:
            assert {"channel", "unit", "rms", "floor", "validation_rms"} <= set(error)
    assert [r["effect"] for r in result["ranking"]] == [r.effect for r in RANKING]
    assert set(result["ranking"][0]) >= {
        "effect", "score", "p_value", "expected_drop_percent", "refit_drop_percent", "delta_bic",
        "confused_with",
    }  # fmt: skip
    assert result["ranking"][2]["refit_drop_percent"] is None
    assert result["seconds"]["diagnose"] == 3.0


def test_the_result_holds_the_words_and_the_worst_places(out: Path) -> None:
    diagnosis = json.loads((out / "result.json").read_text("utf-8"))["diagnosis"]
    assert diagnosis["words"] == list(FOUND.words)
    assert len(diagnosis["worst"]) == 10
    assert diagnosis["rounds"][0]["next_experiments"][0]["simulate"] == {"theta2": 1.57}
    assert "seconds" not in diagnosis


def test_the_report_tells_verdict_ladder_ranking_and_maps(out: Path) -> None:
    text = (out / "report.html").read_text("utf-8")
    section = text.split('<section id="diagnosis">')[1].split("</section>")[0]
    assert "What remains: nothing." in section
    for heading in ("Error after each step", "Candidate effects", "Where the model as given fails"):
        assert f"<h3>{heading}</h3>" in section
    for figure in ("Candidates and what they explain",
                   "Error by recording and frequency", "Error by recording and time",
                   "Error over the motion"):  # fmt: skip
        assert f'aria-label="{figure}' in section
    assert "To distinguish Friction and Damping, record" in section
    assert "non-linear already" in section
    assert section.index("What remains") < section.index("Error after each step")


MOST_PAGES = 10
PRINTED = """() => ({
  folded: document.querySelectorAll("details:not([open])").length,
  undrawn: document.querySelectorAll(".plot:not(:has(.main-svg))").length,
  narrow: [...document.querySelectorAll(".plot")].map(p => {
    const place = p.closest(".figures > *") ?? p.closest("section");
    return p.getBoundingClientRect().width / place.clientWidth; }).filter(share => share < 0.95),
  over: [...document.querySelectorAll("table, .plot, math, p")]
    .filter(one => one.getBoundingClientRect().right > innerWidth + 1).length,
})"""


def test_on_a4_it_takes_ten_pages_unfolded_and_as_wide_as_the_paper(
    out: Path, chromium: Any
) -> None:
    page = chromium.new_page(viewport={"width": 702, "height": 1000})
    page.goto((out / "report.html").as_uri())
    page.locator(".js-plotly-plot").first.wait_for()
    assert len(re.findall(rb"/Type\s*/Page\b", page.pdf(prefer_css_page_size=True))) <= MOST_PAGES
    page.emulate_media(media="print")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert page.evaluate(PRINTED) == {"folded": 0, "undrawn": 0, "narrow": [], "over": 0}
    page.emulate_media(media="screen")
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert page.locator("details:not([open])").count() > 0, "what was folded is folded again"
    page.close()


def test_it_opens_with_tables_and_draws_the_ladder_once(out: Path) -> None:
    page = (out / "report.html").read_text("utf-8")
    first = page.split('id="diagnosis"')[0]
    summary = re.search(r'<p class="summary">(.*?)</p>', first)
    assert summary is not None and len(re.findall(r"\d+", summary[1])) < 5
    assert first.count("<table>") >= 2
    assert figure_text(page).count("noise floor, shaded]") == 1


def test_words_are_text_and_never_markup(out: Path) -> None:
    text = (out / "report.html").read_text("utf-8")
    assert "<script>alert" not in text
    assert "&lt;script&gt;alert(1)&lt;/script&gt; the friction" in text


def test_the_tables_hold_ladder_ranking_and_map(out: Path) -> None:
    ladder_rows = pd.read_csv(out / "tables" / "ladder.csv")
    assert list(ladder_rows["step"]) == [0, 0, 1, 1]
    ranks = pd.read_csv(out / "tables" / "ranking.csv")
    assert ranks[ranks["accepted"]]["effect"].tolist() == ["coulomb_friction"]
    cells = pd.read_csv(out / "tables" / "error_map.csv")
    assert set(cells["axis"]) == {"time", "frequency"}
    assert set(cells["channel"]) == set(FLOORS)


def test_without_a_diagnosis_nothing_is_said_of_it(glocal: Outcome, tmp_path: Path) -> None:
    export_outcome(glocal, "", tmp_path)
    result = json.loads((tmp_path / "result.json").read_text("utf-8"))
    assert (result["verdict"], result["diagnosis"], result["ranking"]) == (None, None, [])
    assert '<section id="diagnosis">' not in (tmp_path / "report.html").read_text("utf-8")
    assert not (tmp_path / "tables" / "ladder.csv").exists()


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


def test_the_report_says_which_figures_are_of_which_fit(diagnosed: Outcome) -> None:
    told = which_fit_in_report(diagnosed)
    assert "The estimates above are of the identification fit." in told
    assert (
        ", each in multiples of its noise floor. It also fits the initial state of each recording."
        in told
    )
    assert "FIT" not in told, "the comparisons are the identification's here"
    last = replace(FOUND, parameters=(RANKING[0].parameters[0],))
    told = which_fit_in_report(replace(diagnosed, diagnosis=last)).unescape()
    assert "The estimates above are of the diagnosis fit." in told
    assert "Identification fit: it compares the selected outputs." in told
    theirs = tuple(replace(c, fit_label=DIAGNOSIS_FIT) for c in diagnosed.comparisons)
    theirs_too = which_fit_in_report(replace(diagnosed, comparisons=theirs)).unescape()
    assert "FIT and tip error above are of the diagnosis fit too." in theirs_too
    assert not which_fit_in_report(replace(diagnosed, diagnosis=None))


def test_errors_say_on_the_spot_which_fit_they_are_of(diagnosed: Outcome) -> None:
    assert which_fit(diagnosed.comparisons, diagnosed.fits).startswith("Identification fit: ")
    theirs = [replace(c, fit_label=DIAGNOSIS_FIT) for c in diagnosed.comparisons]
    assert which_fit(theirs, diagnosed.fits).startswith("Diagnosis fit: ")
    assert "also fits the initial state of each recording" in which_fit(theirs, diagnosed.fits)


def test_where_a_servo_follows_the_encoders_no_start_is_said_to_be_fitted() -> None:
    assert diagnosis_frees_starts(["z1", "theta1"], ())
    assert not diagnosis_frees_starts(["u1"], ())


def test_an_effect_that_contains_the_best_says_so() -> None:
    larger = ranked("stribeck_friction", "Stribeck friction", 97.0)
    table = ranking_table((RANKING[0], larger), "coulomb_friction")
    assert "contains Coulomb friction" in table.rows[1].cells
    table = ranking_table((larger, RANKING[0]))
    assert (
        "cannot be distinguished from viscous_friction; part of Stribeck friction"
        in table.rows[1].cells
    )


def test_the_ladders_table_has_a_row_per_step_and_output() -> None:
    table = ladder_table(FOUND)
    assert len(table.rows) == 2 * (len(FLOORS) + 1)
    assert [r.cells[0] for r in table.rows if r.cells[0]] == ["as given", "+ Coulomb friction"]


def test_the_ranking_marks_what_was_added_and_names_its_rivals() -> None:
    table = ranking_table(RANKING, "coulomb_friction")
    assert [r.strong for r in table.rows] == [True, False, False]
    assert "cannot be distinguished from Viscous joint friction" in table.rows[0].cells
    assert "f<sub>c1</sub> = 1.200" in table.rows[0].cells[-1]
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


def test_no_share_in_the_table_is_called_all_of_it() -> None:
    all_of_it = replace(RANKING[0], refit_drop_percent=99.99)
    assert ranking_table((all_of_it,)).rows[0].cells[1] == "> 99.9"


def test_each_step_states_all_sizes_as_they_stand_after_it(diagnosed: Outcome) -> None:
    first = Estimate("EI1", 369.5, 3.3, "N m²", True, "EI_1")
    given = replace(FOUND.steps[0], parameters=(first,))
    grown = replace(
        FOUND.steps[1],
        parameters=(*RANKING[0].parameters, replace(first, value=520.8, std=0.2)),
    )
    table = sizes_table(replace(FOUND, steps=(given, grown)))
    assert table is not None
    told = [[str(c).replace("\N{NO-BREAK SPACE}", " ") for c in row.cells] for row in table.rows]
    assert told[0][1:] == ["370 ± 3 N m²", ""]
    assert told[1][1:] == ["520.8 ± 0.2 N m²", "1.200 ± 0.010 N m"]
    assert sizes_table(FOUND) is None


def test_each_floor_says_where_it_comes_from(diagnosed: Outcome, tmp_path: Path) -> None:
    errors = tuple(replace(e, floor_source="stated") for e in FOUND.steps[0].errors)
    found = replace(FOUND, steps=(replace(FOUND.steps[0], errors=errors),))
    assert all(
        "stated noise" in row.cells for row in ladder_table(found).rows if row.cells[1] != "tip"
    )
    export_outcome(replace(diagnosed, diagnosis=found), "", tmp_path)
    result = json.loads((tmp_path / "result.json").read_text("utf-8"))
    assert {e["floor_source"] for e in result["steps"][0]["errors"]} == {"stated"}
