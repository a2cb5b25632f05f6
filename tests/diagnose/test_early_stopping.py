"""Which refits go on after their first steps."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from flexgui.core.diagnose.evidence import penalised_error
from flexgui.core.diagnose.search_round import still_competitive

COUNT = 1000
BASE = SimpleNamespace(cost=101.0 * COUNT, parametrised=SimpleNamespace(unknowns=range(5)))


def runner(left: float, bound: float, own: int = 1) -> Any:
    """One that left a share of the error above the floor and hopes to leave another."""
    hypothesis = SimpleNamespace(unknowns=range(5 + own))
    costs = [(1.0 + 100.0 * share) * COUNT for share in (left, bound)]
    return SimpleNamespace(
        refit=SimpleNamespace(cost=costs[0], parametrised=hypothesis), bound=costs[1]
    )


def going(*runners: Any) -> list[bool]:
    return still_competitive(runners, BASE, COUNT)  # type: ignore[arg-type]


def test_who_is_far_behind_goes_on_only_where_the_next_step_may_change_that() -> None:
    assert going(runner(0.03, 0.03), runner(0.6, 0.55), runner(0.6, 0.02)) == [True, False, True]


def test_where_nobody_leads_everybody_goes_on() -> None:
    assert going(runner(0.9, 0.9), runner(0.95, 0.94), runner(1.0, 0.98)) == [True] * 3


def test_what_came_apart_is_out_and_outdoes_nobody() -> None:
    astray = runner(0.5, np.inf)
    astray.refit.cost = np.inf
    assert going(runner(0.5, 0.5), astray) == [True, False]


def test_many_parameters_count_against_a_hope() -> None:
    assert going(runner(0.5, 0.5), runner(0.7, 0.6, own=1)) == [True, True]
    assert going(runner(0.5, 0.5), runner(0.7, 0.6, own=9)) == [True, False]


def test_the_merit_of_a_cost_is_the_log_of_what_it_leaves() -> None:
    assert penalised_error(101.0 * COUNT, 51.0 * COUNT, COUNT, 0) == np.log(0.5)
