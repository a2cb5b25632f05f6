"""The paper's study with the paper's settings, and what was promised of it."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from flexgui.core.montecarlo.estimates import WITHIN, agreements, explained, pooled
from flexgui.core.montecarlo.paper_values import FITS
from flexgui.core.montecarlo.settings import make_settings
from flexgui.core.montecarlo.study import study
from flexgui.core.montecarlo.summary import Summary, summarise
from flexgui.core.scenario.read import read_scenario
from flexgui.jobs.executor import Processes
from flexgui.stages.study.findings import ratio_of_deviations
from tests.montecarlo.helpers import records_of

SCENARIO = Path(__file__).parents[2] / "scenarios" / "paper_glocal.toml"

LIMIT = 300.0
"""s for all estimates on two cores."""

EI_RATIO = 50.0
"""Of the relative deviations of epsilon and of EI without noise."""

MISSED = 2
"""Means of d at 20 dB that the paper's own bias in EI puts out of reach: the first local one, and
the local mean. Only epsilon and d on the valley are possible here."""

OFF = 3
"""Of 16 deviations over 20 runs that may lie outside 25 %: a deviation over 20 runs has a standard
error of 16 %, so that about two do."""

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def whole() -> tuple[Summary, float]:
    settings = make_settings(read_scenario(SCENARIO))
    begun = time.monotonic()
    records = records_of(study(settings, executor=Processes(2), only=["fits"]))
    seconds = time.monotonic() - begun
    records |= records_of(
        study(settings, executor=Processes(2), only=["sweeps", "prior", "advice"])
    )
    return summarise(settings, records), seconds


def test_all_estimates_take_less_than_five_minutes(whole: tuple[Summary, float]) -> None:
    assert whole[1] < LIMIT


def test_means_are_the_papers_but_where_its_bias_forbids(whole: tuple[Summary, float]) -> None:
    missed = [a for a in agreements(whole[0].tables) if not a.within]
    assert len(missed) <= MISSED
    assert all(a.name == "d" and a.snr_db == 20.0 for a in missed)


def test_ei_is_fixed_where_epsilon_is_not(whole: tuple[Summary, float]) -> None:
    clean = whole[0].tables[0]
    assert clean.snr_db is None
    assert ratio_of_deviations(clean) > EI_RATIO


def test_prior_and_search_explain_the_deviations(whole: tuple[Summary, float]) -> None:
    summary = whole[0]
    assert summary.prior is not None
    assert all(e.good for e in pooled(summary.tables[0], summary.prior))
    single = [e for e in explained(summary.tables[0], summary.prior) if e.label != "local mean"]
    off = [e for e in single if abs(e.ratio - 1.0) > WITHIN]
    assert len(off) <= OFF


def test_sweeps_are_fitted_better_than_in_the_paper(whole: tuple[Summary, float]) -> None:
    checked = whole[0].validation
    assert checked is not None and len(checked.sweeps) == 10
    assert all(ours >= told for ours, told in zip(checked.mean("lpv"), FITS, strict=True))
    assert max(checked.mean("rigid")) < min(checked.mean("lpv"))
    assert min(checked.mean("nonlinear")) > max(checked.mean("lpv"))


def test_fisher_information_predicts_the_deviations(whole: tuple[Summary, float]) -> None:
    plan = whole[0].planning
    assert plan is not None
    ratios = [p.ratio for p in plan.predicted]
    assert sum(ratios) / len(ratios) == pytest.approx(1.0, abs=WITHIN)
