"""Repeated runs on the page, in the report, in the numbers for scripts and as a table."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexgui.core.identify.repeatability import repeatability
from flexgui.core.results import Estimate, Outcome
from flexgui.core.scenario.stated_effects import base_model
from flexgui.export.report import report_html
from flexgui.export.result import result
from flexgui.export.tables import tables
from flexgui.library.shipped import demo_scenario
from flexgui.stages.identify.panel import repeated_html
from flexgui.views.parameter_tables import between_runs, short_between_runs
from tests.export.helpers import outcome_of

RUNS = ("a", "b", "c", "d", "e")


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    """Five runs of which the third has a friction 20 % larger."""
    made = {
        run: [Estimate("fc1", 0.5 + 0.001 * k, 0.002, "N m", True)] for k, run in enumerate(RUNS)
    }
    made["c"] = [Estimate("fc1", 0.6024, 0.002, "N m", True)]
    return replace(outcome_of(base_model(demo_scenario())), repeated=repeatability(made))


def test_the_table_has_both_deviations_and_the_run_that_differs(outcome: Outcome) -> None:
    table = between_runs(outcome.repeated)
    assert table is not None
    (row,) = table.rows
    assert row.cells[-1] == "c by +20 %"
    assert row.cells[3].endswith("(0.36 %)") and row.cells[4].endswith("(0.4 %)")


def test_the_page_says_it_in_a_sentence_and_a_table(outcome: Outcome) -> None:
    shown = repeated_html(outcome.repeated)
    assert "Runs of the same experiment differ." in shown and "c by +20 %" in shown
    assert repeated_html(()) == "" and short_between_runs(()) is None


def test_report_numbers_and_table_hold_it(outcome: Outcome) -> None:
    assert "c by +20&nbsp;%" in report_html(outcome, "").replace("\u00a0", "&nbsp;")
    (said,) = result(outcome, ())["repeatability"]
    assert said["name"] == "fc1" and said["disagreeing"][0]["run"] == "c"
    assert said["between"] == pytest.approx(np.std([0.5, 0.501, 0.503, 0.504], ddof=1))
    frame = tables(outcome)["repeatability"]
    assert frame["runs_differing"].tolist() == ["c"]
    assert result(replace(outcome, repeated=()), ())["repeatability"] == []
