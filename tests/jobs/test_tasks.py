"""The real tasks, in a warm worker."""

from __future__ import annotations

import json
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np
import pytest

from flexgui.core.progress import Silent
from flexgui.core.results import Outcome
from flexgui.core.scenario.read import parse_scenario
from flexgui.jobs import Finished, Stopped, Task
from flexgui.jobs.messages import NewGeneration
from flexgui.stages.export.task import export
from flexgui.stages.identify.task import identify
from tests.jobs.helpers import PATIENCE, Listener

SCENARIO = """
title = "Two points"
[arm]
preset = "paper"
[drive]
kind = "velocity_loop"
gains = [60.0, 30.0]
[[recordings]]
simulate = {theta2 = 1.2, seconds = 0.3, seed = 1, snr_db = 20}
[[recordings]]
simulate = {theta2 = 2.0, seconds = 0.3, seed = 2, snr_db = 20}
[identify]
parameters = ["epsilon", "d"]
population = 12
generations = 8
"""


def fit_of(text: str) -> Task:
    return Task.of(identify, "The fit", scenario=parse_scenario(text, "test"))


def same(a: object, b: object) -> bool:
    """Equal to the last digit, field by field; apart from seconds, which no two runs share, and a
    cosine of 1e-7, whose rounding depends on where the arrays lie in memory."""
    if is_dataclass(a) and type(a) is type(b):
        names = [f.name for f in fields(a) if f.name not in ("seconds", "gradient_norm")]
        return all(same(getattr(a, n), getattr(b, n)) for n in names)
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, np.ndarray | float):
        return bool(np.array_equal(a, b, equal_nan=True))  # type: ignore[arg-type]
    return a == b


@pytest.fixture(scope="module")
def here() -> Outcome:
    return identify(parse_scenario(SCENARIO, "test"), progress=Silent())


@pytest.mark.long
def test_a_worker_finds_what_this_process_finds(warm_pool, here):
    heard = Listener()
    warm_pool.submit("s", fit_of(SCENARIO), heard)
    found = heard.wait_for(Finished).result
    assert same(found, here)
    assert heard.of(NewGeneration)[-1].generation.number == 8


def test_a_stopped_identification_gives_its_best(warm_pool):
    heard = Listener()
    long = SCENARIO.replace("generations = 8", "generations = 100000")
    job = warm_pool.submit("s", fit_of(long), heard)
    heard.wait_for(NewGeneration)
    assert job.remaining_seconds is None or job.remaining_seconds > 0.0
    job.stop()
    outcome = heard.wait_for(Stopped).result
    assert outcome.fits[0].stopped
    assert 0 < len(outcome.fits[0].convergence) < 100000
    assert all(np.isfinite(e.value) for e in outcome.fits[0].estimates)


@pytest.mark.long
def test_the_report_is_of_the_outcome_given(warm_pool, here, tmp_path: Path):
    out = tmp_path / "report"
    where = {"folder": str(tmp_path), "out": str(out)}
    task = Task.of(export, outcome=here, scenario=parse_scenario(SCENARIO, "test"), **where)
    job = warm_pool.submit("s", task, Listener())
    assert job.wait(PATIENCE), job.state
    assert job.result == str(out)
    assert "<iframe" in (out / "report.html").read_text(), "the motion in 3-D"
    assert json.loads((out / "result.json").read_text())["title"] == "Two points"


def test_a_fit_keeps_its_last_population_only(here):
    """As many as there are generations would be 50 MB of a long search, in every session."""
    generations = here.fits[0].convergence
    assert len(generations) == 8
    assert all(generation.population is None for generation in generations[:-1])
    assert generations[-1].population.shape == (12, 2)
