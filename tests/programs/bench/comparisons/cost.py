"""One glocal cost: seven working points, one vector."""

from __future__ import annotations

from importlib.util import find_spec

from flexgui.core.processors import WORKERS, at_most
from tests.programs.bench.case import AWAY, MEMBERS, Case, glocal_case, population
from tests.programs.bench.peers import (
    Response,
    control_response,
    exact_response,
    lsim_response,
    modal_response,
    peer_cost,
)
from tests.programs.bench.row import Row, Size, least_seconds

SAME = 1e-10
"""Relative: all discretise exactly, so only rounding over 3000 steps may differ."""

RIVALS: dict[str, tuple[Response, tuple[float | None, ...]]] = {
    "modal scipy.signal.lfilter": (modal_response, (40.0, None, 120.0)),
    "scipy.signal.lsim": (lsim_response, (700.0, 1000.0, 1800.0)),
    "control.forced_response": (control_response, (400.0, None, None)),
}
"""Responses and targets: of one vector alone, of one in a population on one and on two threads."""

COMPARED = (0, MEMBERS // 2, MEMBERS - 1)
"""Members whose cost is computed both ways."""


def rows(size: Size) -> list[Row]:
    """One vector alone, and inside a population."""
    case = glocal_case(size.seconds)
    samples = len(case.experiments[0].task.time)
    known = peer_cost(case, exact_response, AWAY)
    single = (
        f"glocal cost, 7 x {samples} samples",
        least_seconds(lambda: case.cost(AWAY), size.repeats),
        abs(float(case.cost(AWAY)[0]) / known - 1.0),
    )
    asked = [single, *(_inside_population(case, k, size) for k in (1, WORKERS))]
    found = []
    for rival, (response, targets) in RIVALS.items():
        if response is control_response and find_spec("control") is None:
            note = "python-control is not installed"
            found.append(Row(*single[:2], value="skipped", note=note, rival=rival))
            continue
        peer = least_seconds(lambda r=response: peer_cost(case, r, AWAY), size.peer_repeats)
        theirs = abs(peer_cost(case, response, AWAY) / known - 1.0)
        for (question, ours, error), target in zip(asked, targets, strict=True):
            same = max(error, theirs) < SAME
            errors = f"{error:.0e} / {theirs:.0e} relative"
            note = "held inputs, exact on both sides; peer on one core"
            found.append(Row(question, ours, peer, target, same, "", note, rival, errors))
    return found


def _inside_population(case: Case, workers: int, size: Size) -> tuple[str, float, float]:
    """The question, our time of a member and the largest relative error."""
    members = population()
    with at_most(workers):
        each = least_seconds(lambda: case.cost(members), size.repeats) / MEMBERS
        costs = case.cost(members)
    known = {i: peer_cost(case, exact_response, members[i]) for i in COMPARED}
    worst = max(abs(float(costs[i]) / cost - 1.0) for i, cost in known.items())
    return f"one cost inside a population of {MEMBERS}, {workers} thread(s)", each, worst
