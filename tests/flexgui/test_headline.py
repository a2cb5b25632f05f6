"""What stands first is the model as it now stands; the first fit stands beside it, marked."""

from __future__ import annotations

from dataclasses import replace

import pytest

from flexgui.core.results import Estimate, Outcome
from flexgui.export.report import FIRST_FIT, report_html
from flexgui.export.result import result
from flexgui.stages.identify.panel import parameters_html, repeated_html
from flexgui.views.headline import STILL_MISSING, final_comparisons
from flexgui.views.parameter_tables import final_parameters
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
    assert ["444" in readable(text) for text in told] == [False, True]
