"""What the prior says along the valley ε d⁴ = const, with and without the search."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from core.montecarlo.estimates import EstimateTable, Spread, spread
from core.resumable.journal import Record

STEPS = 20001
"""Of the integral over the valley; its error is far below a digit that is shown."""

WITHIN = 0.25
"""Share by which a deviation found over 20 runs may differ from the one expected: two and a half
standard errors of a deviation over 20 draws of a flat distribution."""


@dataclass(frozen=True)
class ValleyPrior:
    """Expected deviations of ε and d along the valley."""

    bounds: Mapping[str, tuple[float, float]]
    EI: float
    """N m², of the valley."""
    flat: Mapping[str, Spread]
    """The uniform prior, given EI: where a search would end that does not move along it."""
    searched: Mapping[str, Spread]
    """The same prior after the search (differential evolution draws together along a bent
    valley)."""
    draws: int


@dataclass(frozen=True)
class Explained:
    """One deviation found at SNR ∞ against the one expected."""

    label: str
    name: str
    found: float
    expected: float

    @property
    def ratio(self) -> float:
        """Found spread over expected one."""
        return self.found / self.expected

    @property
    def good(self) -> bool:
        """Whether the valley explains the spread."""
        return abs(self.ratio - 1.0) <= WITHIN


def valley_prior(records: Mapping[str, Record], EI: float) -> ValleyPrior | None:
    """None where the part `prior` has no result yet."""
    answers = [r["answer"] for key, r in sorted(records.items()) if r["part"] == "prior"]
    if not answers:
        return None
    bounds = {n: (float(b[0]), float(b[1])) for n, b in answers[0]["bounds"].items()}
    ends = [end for a in answers for end in a["ends"]]
    searched = {n: spread([end[n] for end in ends]) for n in bounds}
    return ValleyPrior(bounds, EI, flat_prior(bounds, EI), searched, len(ends))


def flat_prior(bounds: Mapping[str, tuple[float, float]], EI: float) -> dict[str, Spread]:
    """Mean and deviation of ε and d, uniform in a box, given ε d⁴ / 12 = EI.

    With (ε, EI) instead of (ε, d) the density is |dd/dEI| = d / (4 EI), so ∝ d along the valley.
    """
    epsilon = np.linspace(*bounds["epsilon"], STEPS)
    d = (12.0 * EI / epsilon) ** 0.25
    low, high = bounds["d"]
    weight = np.where((d >= low) & (d <= high), d, 0.0)
    found = {}
    for name, values in (("epsilon", epsilon), ("d", d)):
        mean = float(np.average(values, weights=weight))
        std = float(np.sqrt(np.average((values - mean) ** 2, weights=weight)))
        found[name] = Spread(mean, std)
    return found


def explained(table: EstimateTable, prior: ValleyPrior) -> tuple[Explained, ...]:
    """Every fit's deviations of ε and d; the mean of n locals is expected to scatter less."""
    found = []
    shrink = {"local mean": len(table.locals) ** -0.5}
    for row in table.rows:
        for name in prior.bounds:
            expected = prior.searched[name].std * shrink.get(row.label, 1.0)
            found.append(Explained(row.label, name, row.values[name].std, expected))
    return tuple(found)


def pooled(table: EstimateTable, prior: ValleyPrior) -> tuple[Explained, ...]:
    """All single fits together: the root mean square of their deviations."""
    single = [*table.locals, table.row("glocal")]
    found = []
    for name in prior.bounds:
        rms = float(np.sqrt(np.mean([row.values[name].std ** 2 for row in single])))
        found.append(Explained("all fits", name, rms, prior.searched[name].std))
    return tuple(found)
