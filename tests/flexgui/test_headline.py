"""What stands first is the model as it now stands; the first fit stands beside it, marked."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from flexgui.core.results import Estimate, LinearModel, Outcome, RecordingComparison
from flexgui.export.export_files import export_outcome
from flexgui.export.report import FIRST_FIT
from flexgui.sentences.figures import linear_sentence
from flexgui.stages.identify.panel import parameters_html
from flexgui.views.fit_table import fit_table
from flexgui.views.headline import BIASED, COMPLETE, STILL_MISSING, final_comparisons
from flexgui.views.parameter_tables import final_parameters
from flexgui.views.summary import summary
from tests.flexgui.test_diagnosis_report import FOUND

FINAL_EI, FRICTION = 520.1, 1.2
DIAGNOSED = 'title = "diagnosed"\n'
LINEAR = LinearModel(2e-4, 4e-5, 3e-5)


def better(comparison: RecordingComparison) -> RecordingComparison:
    """The same recording with a tenth of the error."""
    channels = tuple(replace(c, model=c.measured - 0.1 * c.residual) for c in comparison.channels)
    return replace(comparison, channels=channels, tip_rms=4e-5)


def unglued(text: str) -> str:
    """Without what keeps numbers and units on one line."""
    return text.replace("\N{NO-BREAK SPACE}", " ").replace("\N{NARROW NO-BREAK SPACE}", " ")


@pytest.fixture(scope="module")
def after(glocal: Outcome) -> Outcome:
    """A ladder that ended at the floor."""
    parameters = (
        Estimate("EI1", FINAL_EI, 0.2, "N m²", True, "EI_1"),
        Estimate("fc1", FRICTION, 0.01, "N m", True, "f_{c1}"),
    )
    found = replace(
        FOUND,
        parameters=parameters,
        origins={"EI1": "arm", "fc1": "coulomb_friction"},
        values={"EI1": FINAL_EI, "fc1": FRICTION},
        given=glocal.comparisons,
        left=tuple(better(c) for c in glocal.comparisons),
        linear_model=LINEAR,
    )
    return replace(glocal, diagnosis=found, origins={"lambda1": "drive"})


@pytest.fixture(scope="module")
def out(after: Outcome, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("headline")
    export_outcome(after, "title = 'x'", folder, beside={"diagnosed.toml": DIAGNOSED.encode()})
    return folder


@pytest.fixture(scope="module")
def result(out: Path) -> dict:
    return dict(json.loads((out / "result.json").read_text("utf-8")))


def test_the_result_holds_the_final_model_with_what_each_value_belongs_to(result: dict) -> None:
    told = {p["name"]: (p["value"], p["of"]) for p in result["parameters"]}
    assert told == {"EI1": (FINAL_EI, "arm"), "fc1": (FRICTION, "coulomb_friction")}
    assert not any(p["biased"] for p in result["parameters"])


def test_the_first_fit_stands_beside_it_and_is_marked_as_biased(result: dict) -> None:
    given = {p["name"]: p for p in result["parameters_as_given"]}
    assert set(given) == {"epsilon", "d", "lambda1", "EI"}
    assert all(p["biased"] for p in given.values())
    assert given["lambda1"]["of"] == "drive"


def test_the_first_fit_is_not_called_biased_where_nothing_was_missing(
    after: Outcome, glocal: Outcome, tmp_path: Path
) -> None:
    assert after.diagnosis is not None
    nothing = replace(after.diagnosis, verdict="nothing_missing", steps=FOUND.steps[:1], left=())
    for k, outcome in enumerate((glocal, replace(after, diagnosis=nothing))):
        export_outcome(outcome, "", tmp_path / str(k))
        told = json.loads((tmp_path / str(k) / "result.json").read_text("utf-8"))
        assert told["parameters_as_given"]
        assert not any(p["biased"] for p in told["parameters_as_given"])
        assert "biased" not in (tmp_path / str(k) / "report.html").read_text("utf-8")


def test_the_recordings_are_those_of_the_final_model_with_those_as_given_beside(
    result: dict, after: Outcome
) -> None:
    rms = result["recordings"][0]["channels"][0]["rms"]
    was = result["recordings_as_given"][0]["channels"][0]["rms"]
    assert rms == pytest.approx(0.1 * was)
    assert was == pytest.approx(after.comparisons[0].channels[0].rms)


def test_what_the_linear_model_costs_is_a_key_of_its_own(result: dict) -> None:
    assert result["linear_model"] == {"tip_rms_m": 2e-4, "full_equations_tip_rms_m": 4e-5}
    assert result["diagnosis"]["words"][0] == linear_sentence(LINEAR)


def test_tables_say_what_each_value_belongs_to_and_keep_the_first_fit(out: Path) -> None:
    final = pd.read_csv(out / "tables" / "parameters.csv")
    assert dict(zip(final["parameter"], final["of"], strict=True)) == {
        "EI1": "arm", "fc1": "coulomb_friction",
    }  # fmt: skip
    given = pd.read_csv(out / "tables" / "parameters_as_given.csv")
    assert set(given["parameter"]) == {"epsilon", "d", "lambda1", "EI"}
    assert given["biased"].all() and not final["biased"].any()
    fits = pd.read_csv(out / "tables" / "fit.csv")
    assert set(fits["model"]) == {"as it now stands", "as given"}


def test_the_table_of_a_recording_holds_both_models(out: Path) -> None:
    table = pd.read_csv(out / "tables" / "recording_th1.csv")
    counted = table["ydot1 counted"] == 1
    left, was = (table[f"ydot1 residual{x} [rad/s]"][counted] for x in ("", " as given"))
    assert (left - 0.1 * was).abs().max() < 1e-9  # ten digits are kept


def test_the_diagnosed_scenario_lies_beside_and_is_listed(out: Path, result: dict) -> None:
    assert (out / "diagnosed.toml").read_text("utf-8") == DIAGNOSED
    assert "diagnosed.toml" in result["files"]


def test_the_report_shows_the_final_values_and_marks_the_first(out: Path) -> None:
    text = unglued((out / "report.html").read_text("utf-8"))
    section = text.split('<section id="parameters">')[1].split("</section>")[0]
    assert section.index("520.1 ± 0.2") < section.index("First fit")
    assert "Coulomb friction" in section and unglued(COMPLETE) in section
    assert f"{BIASED[0].upper()}{BIASED[1:]}" in section
    assert "FIT as given" in text.split('<section id="fit">')[1]
    assert text.index(unglued(linear_sentence(LINEAR))) < text.index("What remains: nothing.")


def test_the_summary_begins_with_the_model_as_it_now_stands(after: Outcome) -> None:
    told = " ".join(str(s) for s in summary(after))
    assert "with the full equations and Coulomb friction in the model" in told
    assert told.index("520.1") < told.index("520.83") < told.index(BIASED)
    assert COMPLETE in told and "(model as given: " in told


def test_values_of_a_model_that_still_lacks_something_are_said_to_be_biased(
    after: Outcome,
) -> None:
    assert after.diagnosis is not None
    short = replace(after, diagnosis=replace(after.diagnosis, final_verdict="missing"))
    assert STILL_MISSING in final_parameters(short).caption
    assert STILL_MISSING not in final_parameters(after).caption


def test_identify_shows_the_diagnosis_fit_with_the_first_one_in_a_fold(
    after: Outcome, glocal: Outcome
) -> None:
    shown = unglued(parameters_html(after))
    table, fold = shown.split("<details>")
    assert "520.1 ± 0.2 N m²" in table and "520.83" not in table
    assert "520.83 ± 0.02 N m²" in fold
    assert "Bounds" not in shown, "a panel has no room for them"
    assert "<details>" not in parameters_html(glocal)


@pytest.mark.parametrize("steps", [1, 2])
def test_tables_of_errors_are_of_the_fit_that_the_parameters_are_of(
    after: Outcome, steps: int
) -> None:
    assert after.diagnosis is not None
    ends = after.diagnosis.left if steps > 1 else ()
    theirs = tuple(better(c) for c in after.comparisons)
    found = replace(after.diagnosis, steps=FOUND.steps[:steps], given=theirs, left=ends)
    shown = final_comparisons(replace(after, diagnosis=found))
    assert shown == (ends or theirs)


def test_what_belongs_to_a_recording_has_moved_with_the_rest(after: Outcome) -> None:
    own = Estimate("offset_u1", 0.5, 0.1, "N m", True, recording="th1")
    fit = replace(after.fits[0], estimates=(*after.fits[0].estimates, own))
    assert after.diagnosis is not None
    found = replace(after.diagnosis, values={**after.diagnosis.values, "offset_u1@th1": 0.7})
    rows = final_parameters(replace(after, fits=(fit,), diagnosis=found)).rows
    assert any("th1" in row.cells and "0.7" in str(row.cells) for row in rows)


def test_figures_as_given_stand_in_columns_of_their_own(after: Outcome) -> None:
    assert after.diagnosis is not None
    table = fit_table(after.diagnosis.left, after.diagnosis.given)
    assert [c.title for c in table.columns[-2:]] == ["FIT as given [%]", "Rms as given"]
    assert all(len(row.cells) == len(table.columns) and row.cells[-1] for row in table.rows)


def test_only_figures_of_the_first_fit_are_called_that(after: Outcome, tmp_path: Path) -> None:
    """On the page the last identification already knows what was added."""
    given = (Estimate("EI1", 369.5, 3.3, "N m²", True, "EI_1"),)
    for k, outcome in enumerate((after, replace(after, as_given=given))):
        export_outcome(outcome, "", tmp_path / str(k))
    told = [unglued((tmp_path / str(k) / "report.html").read_text("utf-8")) for k in (0, 1)]
    assert [FIRST_FIT in text for text in told] == [True, False]
    assert "370 ± 3 N m²" in told[1] and "370 ± 3 N m²" not in told[0]
