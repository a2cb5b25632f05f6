"""The benchmark: it runs, prints every ratio, and both sides give the same answers.

Speed itself is never asserted: it is the machine's.
"""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
import pytest
from rich.console import Console

from flexgui.core.processors import at_most
from tests.bench import measure
from tests.bench.casadi_arm import lacking
from tests.bench.case import MEMBERS, glocal_case, population
from tests.bench.row import Row, duration, least_seconds, ratio, table

pytestmark = pytest.mark.long

ROUNDING = 1e-12
"""Relative: the same arithmetic, shared out differently."""
PEERS = ("lfilter", "lsim", "forced_response", "differential evolution", "solve_ivp", "CasADi")


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    return measure(quick=True)


@pytest.mark.parametrize("peer", PEERS)
def test_both_sides_give_the_same_answer(rows: list[Row], peer: str) -> None:
    found = [row for row in rows if peer in row.what]
    assert found
    for row in found:
        if row.value == "skipped":
            assert find_spec("control") is None or lacking()
        else:
            assert row.same is True, row.note


def test_no_comparison_is_with_another_answer(rows: list[Row]) -> None:
    assert [row.note for row in rows if row.same is False] == []


def test_every_comparison_has_a_ratio_or_says_why_not(rows: list[Row]) -> None:
    console = Console(width=250, record=True, file=None, quiet=False)
    with console.capture() as shown:
        console.print(table(rows, quick=True))
    text = shown.get()
    for row in rows:
        assert row.ours > 0.0
        if row.ratio is not None:
            assert row.ratio > 0.0
            assert ratio(row) in text
        else:
            assert row.value in text


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_threads_do_not_change_the_cost(workers: int) -> None:
    case, members = glocal_case(0.1), population()
    expected = np.array([float(case.cost(member)[0]) for member in members])
    with at_most(workers):
        assert case.cost(members) == pytest.approx(expected, rel=ROUNDING)
    assert len(expected) == MEMBERS


def test_times_are_of_the_quickest_run_in_a_unit_that_suits() -> None:
    calls: list[int] = []
    assert least_seconds(lambda: calls.append(1), 3) >= 0.0
    assert len(calls) == 4
    assert [duration(t) for t in (2.0, 3e-3, 4.5e-5, None)] == ["2 s", "3 ms", "45 µs", ""]
