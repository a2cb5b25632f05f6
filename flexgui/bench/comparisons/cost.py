"""One glocal cost: seven working points, one vector."""

from __future__ import annotations

from importlib.util import find_spec

from flexgui.bench.case import AWAY, MEMBERS, Case, glocal_case, population
from flexgui.bench.peer_linear import Response, control_response, lsim_response, peer_cost
from flexgui.bench.row import Row, median_seconds
from flexgui.bench.size import Size

SAME = 1e-8
"""Relative: both discretise exactly, so only rounding over 3000 steps may differ."""


def rows(size: Size) -> list[Row]:
    """Against scipy.signal.lsim and control.forced_response, and inside a population."""
    case = glocal_case(size.seconds)
    ours = median_seconds(lambda: case.cost(AWAY), size.repeats)
    samples = len(case.experiments[0].task.time)
    what = f"glocal cost, 7 x {samples} samples"
    found = [_row(case, ours, f"{what}, scipy.signal.lsim", lsim_response, 300.0, size)]
    name = f"{what}, control.forced_response"
    if find_spec("control") is None:
        found.append(Row(name, ours, value="skipped", note="python-control is not installed"))
    else:
        found.append(_row(case, ours, name, control_response, 400.0, size))
    return [*found, _inside_population(case, size)]


def _row(case: Case, ours: float, what: str, response: Response, target: float, size: Size) -> Row:
    peer = median_seconds(lambda: peer_cost(case, response, AWAY), size.peer_repeats)
    difference = abs(peer_cost(case, response, AWAY) / float(case.cost(AWAY)[0]) - 1.0)
    note = f"relative difference {difference:.0e}; discretised with zero-order hold"
    return Row(what, ours, peer, target, difference < SAME, note=note)


def _inside_population(case: Case, size: Size) -> Row:
    members = population()
    each = median_seconds(lambda: case.cost(members), size.repeats) / MEMBERS
    note = f"on {case.cost.workers} threads"
    return Row(f"one cost inside a population of {MEMBERS}", each, value="-", note=note)
