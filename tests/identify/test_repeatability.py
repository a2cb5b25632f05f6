"""Repeated runs: intervals hold what they promise, and a changed run is named."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.identify.repeatability import FEWEST, repeatability
from flexgui.core.results import Estimate

SETS = 400
"""Sets of runs: a share of 0.93 is known to 0.01."""
COVERS, NAMED, FALSE = 0.93, 0.95, 0.05
RUNS = ("a", "b", "c", "d", "e")
TRUE = {"fc1": 0.5, "EI1": 2.7}


def runs(
    rng: np.random.Generator, within: float, between: float, changed: float = 0.0
) -> dict[str, list[Estimate]]:
    """Five runs; shares of the true values. Run c has another friction."""
    made = {}
    for run in RUNS:
        made[run] = []
        for name, true in TRUE.items():
            factor = 1.0 + (changed if (run, name) == ("c", "fc1") else 0.0)
            value = true * (factor + between * rng.standard_normal())
            value += within * true * rng.standard_normal()
            made[run].append(Estimate(name, value, within * true, "", True))
    return made


@pytest.mark.parametrize(("within", "between"), [(0.02, 0.0), (0.01, 0.03), (0.005, 0.005)])
def test_intervals_between_runs_hold_the_truth(within: float, between: float) -> None:
    rng, held = np.random.default_rng(1), []
    for _ in range(SETS):
        for one in repeatability(runs(rng, within, between)):
            low, high = one.interval
            held.append(low <= TRUE[one.name] <= high)
    assert np.mean(held) >= COVERS


@pytest.mark.parametrize(("within", "between"), [(0.01, 0.0), (0.01, 0.01)])
def test_a_run_with_changed_friction_is_named(within: float, between: float) -> None:
    rng, named = np.random.default_rng(2), []
    for _ in range(SETS):
        found = {one.name: one for one in repeatability(runs(rng, within, between, changed=0.2))}
        named.append([d.run for d in found["fc1"].disagreeing] == ["c"])
    assert np.mean(named) >= NAMED


@pytest.mark.parametrize(("within", "between"), [(0.02, 0.0), (0.01, 0.03)])
def test_equal_runs_are_rarely_accused(within: float, between: float) -> None:
    rng = np.random.default_rng(3)
    said = [
        any(one.disagreeing for one in repeatability(runs(rng, within, between)))
        for _ in range(SETS)
    ]
    assert np.mean(said) <= FALSE


def test_what_a_run_does_not_know_is_left_out() -> None:
    made = runs(np.random.default_rng(4), 0.02, 0.0)
    made["b"][0] = Estimate("fc1", 0.5, np.nan, "", True)
    assert [one.name for one in repeatability(made)] == ["EI1"]
    few = dict(list(made.items())[: FEWEST - 1])
    assert repeatability(few) == ()


def test_a_run_that_differs_is_found_with_its_size() -> None:
    made = {run: [Estimate("fc1", 0.5, 0.002, "N m", True)] for run in RUNS}
    made["c"] = [Estimate("fc1", 0.6, 0.002, "N m", True)]
    (found,) = repeatability(made)
    (odd,) = found.disagreeing
    assert odd.run == "c" and odd.share == pytest.approx(0.2)
