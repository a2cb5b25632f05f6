"""What stands first is the model as it now stands; the first fit stands beside it, marked."""

from __future__ import annotations

from dataclasses import replace
from math import isnan

import pytest

from flexgui.core.results import Estimate, Outcome
from flexgui.export.report import FIRST_FIT, report_html
from flexgui.export.result import result
from flexgui.stages.identify.panel import parameters_html, repeated_html
from flexgui.views.headline import STILL_MISSING, final_comparisons
from flexgui.views.parameter_tables import (
    Change,
    changes,
    final_parameters,
    first_parameters,
    parameter_changes,
)
from tests.approved import approved
from tests.export.helpers import readable
from tests.flexgui.findings import FOUND, better


def test_the_first_fit_is_not_called_biased_where_nothing_was_missing(
    diagnosed: Outcome, glocal: Outcome
) -> None:
    assert diagnosed.diagnosis is not None
    nothing = replace(
        diagnosed.diagnosis, verdict="nothing_missing", steps=FOUND.steps[:1], left=()
    )
    for outcome in (glocal, replace(diagnosed, diagnosis=nothing)):
        told = result(outcome, ())
        assert told["parameters_as_given"]
        assert not any(p["biased"] for p in told["parameters_as_given"])
        assert "biased" not in report_html(outcome, "")


def test_values_of_a_model_that_still_lacks_something_are_said_to_be_biased(
    diagnosed: Outcome,
) -> None:
    assert diagnosed.diagnosis is not None
    short = replace(diagnosed, diagnosis=replace(diagnosed.diagnosis, final_verdict="missing"))
    assert STILL_MISSING in final_parameters(short).caption
    assert STILL_MISSING not in final_parameters(diagnosed).caption


def test_identify_shows_the_diagnosis_fit_with_the_first_one_in_a_fold(
    diagnosed: Outcome, glocal: Outcome
) -> None:
    shown = parameters_html(diagnosed) + repeated_html(diagnosed.repeated)
    approved("identify_panel.txt", readable(shown))
    assert "<details>" not in parameters_html(glocal) and repeated_html(()) == ""


@pytest.mark.parametrize("steps", [1, 2])
def test_tables_of_errors_are_of_the_fit_that_the_parameters_are_of(
    diagnosed: Outcome, steps: int
) -> None:
    assert diagnosed.diagnosis is not None
    ends = diagnosed.diagnosis.left if steps > 1 else ()
    theirs = tuple(better(c) for c in diagnosed.comparisons)
    found = replace(diagnosed.diagnosis, steps=FOUND.steps[:steps], given=theirs, left=ends)
    shown = final_comparisons(replace(diagnosed, diagnosis=found))
    assert shown == (ends or theirs)


def test_what_belongs_to_a_recording_has_moved_with_the_rest(diagnosed: Outcome) -> None:
    own = Estimate("offset_u1", 0.5, 0.1, "N m", True, recording="th1")
    fit = replace(diagnosed.fits[0], estimates=(*diagnosed.fits[0].estimates, own))
    assert diagnosed.diagnosis is not None
    values = {**diagnosed.diagnosis.values, "offset_u1@th1": 0.7}
    found = replace(diagnosed.diagnosis, values=values)
    rows = final_parameters(replace(diagnosed, fits=(fit,), diagnosis=found)).rows
    assert any("th1" in row.cells and "0.7" in str(row.cells) for row in rows)


def test_only_figures_of_the_first_fit_are_called_that(diagnosed: Outcome) -> None:
    """On the page the last identification already knows what was added."""
    given = (Estimate("EI1", 444.5, 3.3, "N m²", True, "EI_1"),)
    told = [report_html(each, "") for each in (diagnosed, replace(diagnosed, as_given=given))]
    assert [FIRST_FIT in text for text in told] == [True, False]


def test_a_report_has_one_figure_of_each_parameter_as_given_that_of_the_diagnosis_fit(
    diagnosed: Outcome,
) -> None:
    identified = first_parameters(diagnosed)
    assert identified is not None and "520.83 ± 0.02" in str(identified.rows)
    told = readable(report_html(diagnosed, ""))
    assert "EI₁ | N m² | 369.5 ± 0.2 | 520.1 ± 0.2 | +753" in told
    assert "520.83" not in told


def test_a_change_is_in_deviations_of_the_value_as_given_where_both_are_known() -> None:
    given = Estimate("EI1", 530.0, 3.0, "N m²", True, "EI_{1}")
    own = Estimate("start_theta1", 0.1, 0.01, "rad", True, recording="th1")
    now = (replace(given, value=521.0), Estimate("fc1", 1.2, 0.1, "N m", True, "f_{c1}"))
    steps = (replace(FOUND.steps[0], parameters=(given, own)), FOUND.steps[1])
    moved, added = changes(steps, now)
    assert moved.in_std == -3.0
    assert added.before is None and isnan(added.in_std)
    assert isnan(Change(replace(given, std=float("nan")), now[0]).in_std)
    assert changes(steps[:1], now) == () and parameter_changes((), "nothing") is None
    table = parameter_changes((moved, added, Change(given, None)), "Coulomb friction")
    assert table is not None
    assert [row.cells[2:] for row in table.rows] == [
        ("530 ± 3", "521 ± 3", "−3.0"), ("–", "1.20 ± 0.10", "new"), ("530 ± 3", "–", "–"),
    ]  # fmt: skip
