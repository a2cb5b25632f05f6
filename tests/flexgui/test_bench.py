"""The benchmark: it runs, prints every ratio, and both sides give the same answers.

Speed itself is never asserted: it is the machine's.
"""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
import pytest
from rich.console import Console

from flexgui.core.lanes.wide import LANES
from tests.bench import measure
from tests.bench.case import MEMBERS, glocal_case, population
from tests.bench.comparisons.peak import ACCUMULATORS, multiply_add, operations
from tests.bench.row import Row, duration, median_seconds, table

pytestmark = pytest.mark.long

ROUNDING = 1e-12
"""Relative: the same arithmetic, shared out differently."""
PEERS = ("lsim", "forced_response", "differential evolution", "solve_ivp")


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    return measure(quick=True)


@pytest.mark.parametrize("peer", PEERS)
def test_both_sides_give_the_same_answer(rows: list[Row], peer: str) -> None:
    found = [row for row in rows if peer in row.what]
    assert found
    for row in found:
        if row.value == "skipped":
            assert find_spec("control") is None
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
            assert f"{row.ratio:.0f} x" in text
        else:
            assert row.value in text


def test_share_of_the_peak_is_a_share(rows: list[Row]) -> None:
    shares = [float(row.value.rstrip(" %")) for row in rows if "peak" in row.what]
    assert len(shares) == 2
    assert all(share > 0.0 for share in shares)


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_threads_do_not_change_the_cost(workers: int) -> None:
    case, members = glocal_case(0.1), population()
    expected = np.array([float(case.cost(member)[0]) for member in members])
    usual = case.cost.workers
    try:
        case.cost.workers = workers
        assert case.cost(members) == pytest.approx(expected, rel=ROUNDING)
    finally:
        case.cost.workers = usual
    assert len(expected) == MEMBERS


def test_the_peak_counts_what_it_computes() -> None:
    assert operations(3) == 2 * 3 * ACCUMULATORS * LANES
    # Sum i starts at i and becomes i / 2 + 1 / 2 in each turn, in all lanes.
    sums = np.arange(ACCUMULATORS, dtype=float)
    for _ in range(3):
        sums = 0.5 * sums + 0.5
    assert multiply_add(3, 0.5) == pytest.approx(LANES * sums.sum(), rel=ROUNDING)


def test_times_are_medians_in_a_unit_that_suits() -> None:
    calls: list[int] = []
    assert median_seconds(lambda: calls.append(1), 3) >= 0.0
    assert len(calls) == 4
    assert [duration(t) for t in (2.0, 3e-3, 4.5e-5, None)] == ["2 s", "3 ms", "45 µs", ""]
