"""One glocal cost: seven working points, one vector."""

from __future__ import annotations

from importlib.util import find_spec

from tests.bench.case import AWAY, MEMBERS, Case, glocal_case, population
from tests.bench.peers import Response, control_response, lsim_response, peer_cost
from tests.bench.row import Row, Size, median_seconds

SAME = 1e-10
"""Relative: both discretise exactly, so only rounding over 3000 steps may differ."""

SINGLE, ONE_THREAD, TWO_THREADS = 700.0, 1000.0, 1800.0
"""Targets against lsim, of one vector alone and of one in a population."""

COMPARED = (0, MEMBERS // 2, MEMBERS - 1)
"""Members whose cost is computed both ways."""


def rows(size: Size) -> list[Row]:
    """Against scipy.signal.lsim and control.forced_response, and inside a population."""
    case = glocal_case(size.seconds)
    ours = median_seconds(lambda: case.cost(AWAY), size.repeats)
    samples = len(case.experiments[0].task.time)
    what = f"glocal cost, 7 x {samples} samples"
    found = [_row(case, ours, f"{what}, scipy.signal.lsim", lsim_response, SINGLE, size)]
    name = f"{what}, control.forced_response"
    if find_spec("control") is None:
        found.append(Row(name, ours, value="skipped", note="python-control is not installed"))
    else:
        found.append(_row(case, ours, name, control_response, 400.0, size))
    peer = found[0].peer
    assert peer is not None
    rates = ((1, ONE_THREAD), (case.cost.workers, TWO_THREADS))
    return [*found, *(_inside_population(case, peer, *rate, size) for rate in rates)]


def _row(case: Case, ours: float, what: str, response: Response, target: float, size: Size) -> Row:
    peer = median_seconds(lambda: peer_cost(case, response, AWAY), size.peer_repeats)
    difference = abs(peer_cost(case, response, AWAY) / float(case.cost(AWAY)[0]) - 1.0)
    note = f"relative difference {difference:.0e}; discretised with zero-order hold"
    return Row(what, ours, peer, target, difference < SAME, note=note)


def _inside_population(case: Case, peer: float, workers: int, target: float, size: Size) -> Row:
    members, usual = population(), case.cost.workers
    case.cost.workers = workers
    try:
        each = median_seconds(lambda: case.cost(members), size.repeats) / MEMBERS
        costs = case.cost(members)
    finally:
        case.cost.workers = usual
    worst = max(
        abs(peer_cost(case, lsim_response, members[i]) / float(costs[i]) - 1.0) for i in COMPARED
    )
    note = f"relative difference {worst:.0e}"
    what = f"one cost inside a population of {MEMBERS}, {workers} thread(s), scipy.signal.lsim"
    return Row(what, each, peer, target, worst < SAME, note=note)
