"""Repeatability: how well each parameter repeats over runs, and which run disagrees.

The estimates scatter by more than their standard deviations if the rig itself changes (a
random-effects model; DerSimonian & Laird, Controlled Clinical Trials 7, 1986). Each run is tested
against all others.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import scipy

from ..results import Disagreement, Estimate, Repeated

FEWEST_RUNS = 3
"""Fewest runs: of two that differ, either may be the odd one."""
SIGNIFICANCE = 0.05
"""Probability of any false statement, shared among all tests."""
LEAST_DIFFERENCE = 0.02
"""Share of the parameter below which a difference is irrelevant: motor constants change by that
from a cold to a warm room."""


def repeatability(runs: Mapping[str, Sequence[Estimate]]) -> tuple[Repeated, ...]:
    """Repeatability of every parameter that each run has estimated; empty for fewer than
    FEWEST_RUNS. `runs`: name of the run -> its estimates."""
    if len(runs) < FEWEST_RUNS:
        return ()
    tables = [{e.name: e for e in estimates} for estimates in runs.values()]
    names = [n for n in tables[0] if all(n in table for table in tables)]
    names = [n for n in names if all(_is_estimated(table[n]) for table in tables)]
    tests = max(len(runs) * len(names), 1)
    return tuple(_repeated(list(runs), [table[n] for table in tables], tests) for n in names)


def _is_estimated(e: Estimate) -> bool:
    return e.identifiable and bool(np.isfinite(e.std)) and e.std > 0.0 and not e.at_bound


def _repeated(runs: Sequence[str], estimates: Sequence[Estimate], tests: int) -> Repeated:
    x = np.array([e.value for e in estimates])
    s = np.array([e.std for e in estimates])
    odd: list[Disagreement] = []
    kept = list(range(len(x)))
    while len(kept) >= FEWEST_RUNS:  # one odd run makes all scatter look large: the worst first
        tests_of = [_compare_with_others(x, s, i, [k for k in kept if k != i]) for i in kept]
        worst = int(np.argmin([p for p, _ in tests_of]))
        p, share = tests_of[worst]
        if p > SIGNIFICANCE / tests or abs(share) < LEAST_DIFFERENCE:
            break
        odd.append(Disagreement(runs[kept[worst]], share, p))
        del kept[worst]
    own, e = x[kept], estimates[0]
    between = float(np.std(own, ddof=1)) if len(own) > 1 else float(s[kept][0])
    within = float(np.sqrt(np.mean(s[kept] ** 2)))
    half = float(scipy.special.stdtrit(max(len(own) - 1, 1), 0.975)) * between / np.sqrt(len(own))
    mean = float(own.mean())
    return Repeated(e.name, e.unit, mean, between, within, (mean - half, mean + half), tuple(odd))


def _compare_with_others(
    x: np.ndarray, s: np.ndarray, i: int, others: Sequence[int]
) -> tuple[float, float]:
    """(p-value, relative difference) of run i to the mean of the others. Student's distribution
    throughout: that the others happen to agree does not say that they always do."""
    o = list(others)
    weights = 1.0 / s[o] ** 2
    mean = float(weights @ x[o] / weights.sum())
    spread = float(weights @ (x[o] - mean) ** 2)
    denominator = weights.sum() - (weights**2).sum() / weights.sum()
    tau2 = max((spread - (len(o) - 1)) / denominator, 0.0) if denominator > 0 else 0.0
    weights = 1.0 / (s[o] ** 2 + tau2)
    mean = float(weights @ x[o] / weights.sum())
    z = abs(x[i] - mean) / np.sqrt(s[i] ** 2 + tau2 + 1.0 / weights.sum())
    share = float(x[i] / mean - 1.0) if mean else 0.0
    return float(2.0 * scipy.special.stdtr(len(o) - 1, -z)), share
