"""Tables, their formulas, and what they say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexgui.core.errors import InputError
from flexgui.core.montecarlo import paper_values
from flexgui.core.montecarlo.estimates import (
    estimate_tables,
    flat_prior,
    implied_bias,
    least_scatter,
)
from flexgui.core.montecarlo.settings import make_settings
from flexgui.core.montecarlo.study import study
from flexgui.core.montecarlo.summary import Summary, summarise
from flexgui.core.resumable.executor import Here
from flexgui.core.resumable.journal import Record
from flexgui.core.scenario.read import read_scenario
from flexgui.stages.study.findings import conclusions, findings
from flexgui.stages.study.report import study_html, write_study
from tests.montecarlo.helpers import paper_scenario, records_of, short

TRUE_EI = 1e9 * 0.05**4 / 12.0
PRINTED_DIGITS = 5e-4
"""GPa: half a unit of the deviations' third digit, which the paper rounds to."""
DRAWS, SLICE = 2_000_000, 0.002
MONTE_CARLO = 0.02
"""Relative: of a deviation over the twenty thousand draws that fall into the slice."""


@pytest.fixture(scope="module")
def records() -> dict[str, Record]:
    return records_of(study(short(), executor=Here()))


@pytest.fixture(scope="module")
def summary(records: dict[str, Record]) -> Summary:
    return summarise(short(), records)


def test_the_printed_deviation_of_the_mean_obeys_the_formula_that_the_caption_does_not() -> None:
    for table in (paper_values.SNR_NONE, paper_values.SNR_20):
        each = [table[k][1] for k in paper_values.LOCALS]
        told = table[paper_values.MEAN][1]
        assert paper_values.deviation_of_mean(each) == pytest.approx(told, abs=PRINTED_DIGITS)
        assert abs(paper_values.caption_deviation(each) - told) > 0.05


def test_the_papers_means_imply_a_wrong_ei() -> None:
    bias = [100.0 * implied_bias(n, TRUE_EI) for n in paper_values.SNR_NONE]
    assert bias[0] == pytest.approx(7.0, abs=0.1)
    assert bias[6] == pytest.approx(-1.0, abs=0.1)
    assert least_scatter((1.0, 0.1, 50.0, 50.0 * 0.1 / 4.0)) == pytest.approx(0.0, abs=1e-12)


def test_the_prior_on_the_valley_is_that_of_draws_near_it() -> None:
    bounds = {"epsilon": (0.8e9, 1.2e9), "d": (0.04, 0.06)}
    rng = np.random.default_rng(1)
    epsilon, d = (rng.uniform(*bounds[n], DRAWS) for n in ("epsilon", "d"))
    near = np.abs(epsilon * d**4 / 12.0 / TRUE_EI - 1.0) < SLICE
    flat = flat_prior(bounds, TRUE_EI)
    assert flat["epsilon"].std == pytest.approx(epsilon[near].std(), rel=MONTE_CARLO)
    assert flat["d"].std == pytest.approx(d[near].std(), rel=MONTE_CARLO)


def test_a_table_holds_means_and_deviations_of_the_runs(records: dict[str, Record]) -> None:
    table = estimate_tables(short(), records)[0]
    values = [
        r["answer"]["fits"][-1]["values"]["epsilon"]
        for key, r in records.items()
        if key.startswith("fits/inf/")
    ]
    row = table.row("glocal").values["epsilon"]
    assert row.mean == pytest.approx(np.mean(values))
    assert row.std == pytest.approx(np.std(values, ddof=1))
    assert [r.label for r in table.rows][-2:] == ["local mean", "glocal"]


def test_a_summary_does_not_depend_on_the_order_of_the_records(
    records: dict[str, Record], summary: Summary
) -> None:
    turned = dict(reversed(list(records.items())))
    assert [*findings(summarise(short(), turned))] == [*findings(summary)]


def test_half_a_study_has_half_a_summary(records: dict[str, Record]) -> None:
    some = {key: r for key, r in records.items() if r["part"] == "fits"}
    found = summarise(short(), some)
    assert found.tables and found.validation is None and not found.baselines
    assert "Estimates" in study_html(found)
    assert summarise(short(), {}).tables == ()


def test_every_baseline_row_has_its_sentence(summary: Summary) -> None:
    assert {r.method for r in summary.baselines} == {
        "mean of locals", "interpolated black box", "non-linear output error", "glocal",
    }  # fmt: skip
    for row, conclusion in zip(summary.baselines, conclusions(summary.baselines), strict=True):
        assert conclusion.endswith(".")
        assert all(0.0 <= fit <= 100.0 for fit in row.fit.values())


def test_the_report_holds_tables_and_findings(summary: Summary, tmp_path: Path) -> None:
    write_study(summary, tmp_path)
    text = (tmp_path / "study.html").read_text(encoding="utf-8")
    assert "Conclusions" in text and "Experiment advice" in text and "http" not in _own(text)
    names = {path.name for path in tmp_path.glob("*.csv")}
    assert {"estimates.csv", "baselines.csv", "sweeps.csv", "bias.csv", "valley.csv"} <= names
    assert read_scenario(tmp_path / "scenario.toml") == summary.settings.scenario


def _own(text: str) -> str:
    """Without the plotting library."""
    return text[: text.index("<footer>")].replace("http-equiv", "").replace("http://www.w3.org", "")


def test_one_recording_alone_cannot_be_studied() -> None:
    scenario = paper_scenario(points=1)
    with pytest.raises(InputError, match="two estimation recordings"):
        make_settings(scenario)
