"""A whole search by differential evolution."""

from __future__ import annotations

import numpy as np
import scipy

from flexgui.core.identify.fit_starts import (
    CROSSOVER,
    DIFFERENTIAL_WEIGHT,
    evolve,
    first_population,
)
from tests.programs.bench.case import GENERATIONS, LOWER, MEMBERS, UPPER, Case, glocal_case
from tests.programs.bench.peers import modal_response, peer_cost
from tests.programs.bench.row import Row, Size, least_seconds, seconds

SEED = 1
SAME = 1e-6
"""Relative difference of the best costs after the same generations: rounding, which the steep
valley of the cost enlarges."""
FEWEST_REPEATS = 3


def rows(size: Size) -> list[Row]:
    """Against SciPy's search over modal lfilter, the same members and random numbers."""
    case = glocal_case(size.seconds)
    ours = least_seconds(lambda: _search(case, GENERATIONS), max(size.peer_repeats, FEWEST_REPEATS))
    found: list[scipy.optimize.OptimizeResult] = []
    some = seconds(lambda: found.append(peer_search(case, size.peer_generations)))
    expected = _search(case, size.peer_generations)
    apart = abs(float(found[0].fun) / expected - 1.0)
    evaluations = MEMBERS * (GENERATIONS + 1)
    note = (
        f"peer ran {found[0].nfev} of {evaluations} evaluations on one core, the rest is "
        f"extrapolated; best costs compared after {size.peer_generations} generation(s)"
    )
    what = f"differential evolution, {MEMBERS} members, {GENERATIONS} generations"
    peer = some * evaluations / found[0].nfev
    rival = "SciPy's over modal scipy.signal.lfilter"
    errors = f"{apart:.0e} relative, between the best costs"
    return [Row(what, ours, peer, None, apart < SAME, "", note, rival, errors)]


def _search(case: Case, generations: int) -> float:
    """Our best cost."""
    found = evolve(
        case.cost, LOWER, UPPER, MEMBERS, generations, SEED, on_generation=lambda _: False
    )
    return found.cost


def peer_search(case: Case, generations: int) -> scipy.optimize.OptimizeResult:
    """The same settings, one vector at a time."""
    rng = np.random.default_rng(SEED)
    return scipy.optimize.differential_evolution(
        lambda x: peer_cost(case, modal_response, x),
        list(zip(LOWER, UPPER, strict=True)),
        strategy="rand1bin",
        maxiter=generations,
        init=first_population(LOWER, UPPER, MEMBERS, rng),
        mutation=DIFFERENTIAL_WEIGHT,
        recombination=CROSSOVER,
        tol=0.0,
        atol=0.0,
        polish=False,
        updating="deferred",
        rng=rng,
    )
