"""What a fit says: parameters with deviations, correlations, and what the data can tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.identify import identifiability
from core.identify.derived import derived_estimates
from core.identify.refinement import Refined
from core.identify.residuals import Residuals
from core.identify.uncertainty import covariance
from core.identify.unknowns import Unknowns
from core.results import Estimate, Fit, Generation
from core.written import format_number, with_unit

UNSEEN = 1e-12
"""Of the outputs' sum of squares: a cost that no measurement shows. A valley's direction is
good to 1e-8, so that without noise its cost would rise, from nothing to next to nothing."""

AT_BOUND = 1e-6
"""Of the distance between the bounds."""


@dataclass(frozen=True)
class Found:
    """Where a search, or a search and the refinement after it, ended."""

    residuals: Residuals
    refined: Refined
    history: tuple[Generation, ...]
    agreement: str
    stopped: bool


def describe(label: str, found: Found) -> Fit:
    """The fit that a search found, with all that follows from where it ended."""
    residuals, refined = found.residuals, found.refined
    unknowns, vector = residuals.unknowns, refined.vector
    recordings = tuple(e.recording.name for e in residuals.experiments)
    P = len(unknowns)
    blocks = residuals.blocks(vector)
    sensitivities = list(refined.slopes) or residuals.sensitivities(vector)
    jacobian = residuals.vector(sensitivities) if P else np.zeros((1, 0))
    rank, _, null = (
        identifiability.analyse(unknowns, vector, jacobian) if P else (0, None, np.zeros((0, 0)))
    )
    cov = covariance(sensitivities, blocks, rank) if P else np.zeros((0, 0))
    seen = identifiability.identified(null, P) if P else np.zeros(0, dtype=bool)
    known = identifiability.determined(unknowns, vector, cov, null) if P else seen
    fast, floor = residuals.population(vector), UNSEEN * residuals.magnitude

    def cost(v: np.ndarray) -> float:
        found = residuals.costs(v[None]) if fast is None else fast(v[None])
        return floor + float(found[0])

    return Fit(
        label=label,
        recordings=recordings,
        estimates=_estimates(unknowns, vector, cov, seen, known),
        correlation=identifiability.correlation_of(cov),
        cost=refined.cost if np.isfinite(refined.cost) else _sum_of_squares(blocks),
        residual_count=residuals.count,
        convergence=found.history,
        identifiability=identifiability.verdict(unknowns, vector, jacobian, cov, cost),
        gradient_norm=refined.gradient,
        message=found.agreement,
        stopped=found.stopped,
        derived=derived_estimates(residuals.experiments[0].model, unknowns, vector, cov, null),
    )


def _sum_of_squares(blocks: Sequence[np.ndarray]) -> float:
    return sum(float(np.sum(b * b)) for b in blocks)


def _estimates(
    unknowns: Unknowns, vector: np.ndarray, cov: np.ndarray, seen: np.ndarray, known: np.ndarray
) -> tuple[Estimate, ...]:
    """`seen`: has no part in what nothing shows; `known`: is determined by itself."""
    found = []
    for i, item in enumerate(unknowns.items):
        p = item.parameter
        near = AT_BOUND * (p.upper - p.lower)
        value = float(vector[i])
        found.append(
            Estimate(
                name=p.name,
                value=value,
                std=float(np.sqrt(max(cov[i, i], 0.0))) if seen[i] else float("nan"),
                unit=p.unit,
                identifiable=bool(known[i]),
                symbol=p.symbol,
                start=p.value,
                lower=p.lower,
                upper=p.upper,
                recording=item.recording,
                at_bound=bool(value - p.lower < near or p.upper - value < near),
            )
        )
    return tuple(found)


def first_estimate(unknowns: Unknowns, vector: np.ndarray) -> str:
    """Where the first descent ended, in words."""
    pairs = zip(unknowns.items, vector, strict=True)
    shown = [
        f"{item.label} = {with_unit(format_number(float(value)), item.parameter.unit)}"
        for item, value in pairs if item.searched
    ]  # fmt: skip
    more = f" and {len(shown) - SHOWN} more" if len(shown) > SHOWN else ""
    return f"first estimate: {', '.join(shown[:SHOWN])}{more}"


SHOWN = 4
"""Parameters of a first estimate that find room in a line."""
