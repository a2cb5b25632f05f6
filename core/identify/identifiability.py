"""Identifiability: which parameters the data determine.

The singular values of the sensitivities to relative changes show how many directions the outputs
reveal; the null directions are the others.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..identify.unknowns import Unknowns
from ..results import Identifiability, Valley

RANK_TOLERANCE = 1e-6
"""Share of the largest singular value, below which no rig shows a direction. Central differences
leave about 1e-8."""

NEARLY_NOTHING = 0.01
"""Share of the typical size: relative changes of smaller values mean nothing."""

INVOLVED = 0.02
"""Share of a null direction below which a parameter has no part in it."""

POORLY_DISTINGUISHABLE = 0.99
"""Correlation above which two estimates are poorly distinguishable."""

INDISTINGUISHABLE = 0.999
"""Correlation above which neither of two parameters is determined: each standard deviation is
twenty times that with the other fixed. Effects of the same law reach it; differences leave them
1e-5 apart, which no rank shows."""

VALLEY_POINTS = 41
"""Of the drawn curve."""


def relative_scales(unknowns: Unknowns, vector: np.ndarray) -> np.ndarray:
    """(P,): of a `vector` (P,) the value itself where the sign is fixed, else the typical size."""
    parameters = unknowns.parameters
    size, scales = np.abs(vector), parameters.scales()
    own = (parameters.lower() >= 0.0) & (size > NEARLY_NOTHING * scales)
    return np.where(own, size, scales)


def analyse(
    unknowns: Unknowns, vector: np.ndarray, jacobian: np.ndarray, tolerance: float = RANK_TOLERANCE
) -> tuple[int, np.ndarray, np.ndarray]:
    """(rank, singular values (P,), null directions (P - rank, P)) of relative changes of a `vector`
    (P,), with the `jacobian` (K, P). `tolerance`: share of the largest singular value, below which
    nothing shows a direction."""
    scaled = jacobian * relative_scales(unknowns, vector)
    _, values, vectors = np.linalg.svd(np.linalg.qr(scaled, mode="r"))
    largest = values[0] if values.size else 0.0
    rank = int(np.sum(values > tolerance * largest)) if largest > 0.0 else 0
    return rank, values, _sparse(vectors[rank:])


def _sparse(basis: np.ndarray) -> np.ndarray:
    """The same space with as many zeros as elimination gives, each row of unit length."""
    rows = basis.copy()
    used: list[int] = []
    for i in range(len(rows)):
        free = [j for j in range(rows.shape[1]) if j not in used]
        pivot = max(free, key=lambda j: abs(rows[i, j]))
        used.append(pivot)
        rows[i] /= rows[i, pivot]
        for k in range(len(rows)):
            if k != i:
                rows[k] -= rows[k, pivot] * rows[i]
    return rows / np.linalg.norm(rows, axis=1, keepdims=True) if len(rows) else rows


def identified(null: np.ndarray, count: int) -> np.ndarray:
    """(P,) bool: parameters with no part in any null direction of `null` (d, P)."""
    if not len(null):
        return np.ones(count, dtype=bool)
    return np.asarray(np.abs(null).max(axis=0) < INVOLVED)


def determined(
    unknowns: Unknowns, vector: np.ndarray, cov: np.ndarray, null: np.ndarray
) -> np.ndarray:
    """(P,) bool: parameters outside all directions `null` (d, P), with a standard deviation, by
    `cov` (P, P), below their size in a `vector` (P,), that no other one imitates."""
    in_no_null = identified(null, len(vector))
    alike = np.abs(correlation_of(cov)) > INDISTINGUISHABLE
    np.fill_diagonal(alike, False)
    imitated = (alike & np.outer(in_no_null, in_no_null)).any(axis=1)
    return np.asarray(in_no_null & ~wider_than_value(unknowns, vector, cov) & ~imitated)


def wider_than_value(unknowns: Unknowns, vector: np.ndarray, cov: np.ndarray) -> np.ndarray:
    """(P,) bool: parameters whose standard deviation, by `cov` (P, P), exceeds their size in a
    `vector` (P,)."""
    deviations = np.sqrt(np.maximum(np.diag(cov), 0.0))
    return np.asarray(deviations > relative_scales(unknowns, vector))


def correlation_of(cov: np.ndarray) -> np.ndarray:
    """(P, P) of `cov` (P, P); zero where nothing is known."""
    d = np.sqrt(np.maximum(np.diag(cov), 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        rho = cov / np.outer(d, d)
    return np.nan_to_num(rho)


def valley(
    unknowns: Unknowns, vector: np.ndarray, null: np.ndarray, cost: Callable[[np.ndarray], float]
) -> Valley | None:
    """The curve through a `vector` (P,) along which two parameters compensate each other, by `null`
    (d, P), with its cost."""
    for direction in null:
        involved = np.flatnonzero(np.abs(direction) >= INVOLVED)
        items = [unknowns.items[i].parameter for i in involved]
        if len(items) != 2 or not all(item.positive for item in items):
            continue
        a, b = items
        span = _span(vector[involved], direction[involved], (a.lower, b.lower), (a.upper, b.upper))
        steps = np.linspace(*span, VALLEY_POINTS)
        points = vector[involved] * np.exp(np.outer(steps, direction[involved]))
        vectors = np.tile(vector, (VALLEY_POINTS, 1))
        vectors[:, involved] = points
        costs = np.array([cost(v) for v in vectors])
        least = max(float(costs.min()), np.finfo(float).tiny)
        names = (unknowns.labels[involved[0]], unknowns.labels[involved[1]])
        return Valley(names, (a.unit, b.unit), points, costs / least, direction[involved])
    return None


def _span(
    at: np.ndarray, direction: np.ndarray, lower: Sequence[float], upper: Sequence[float]
) -> tuple[float, float]:
    """Steps along a relative direction that stay within the bounds."""
    to_lower = np.log(np.array(lower) / at) / direction
    to_upper = np.log(np.array(upper) / at) / direction
    ends = np.sort(np.array([to_lower, to_upper]), axis=0)
    return float(ends[0].max()), float(ends[1].min())


def identifiability_of(
    unknowns: Unknowns, vector: np.ndarray, jacobian: np.ndarray, cov: np.ndarray,
    cost: Callable[[np.ndarray], float],
) -> Identifiability:  # fmt: skip
    """All of the above in one record, at a `vector` (P,) with `jacobian` (K, P), `cov` (P, P)."""
    rank, values, null = analyse(unknowns, vector, jacobian)
    unsure = np.flatnonzero(wider_than_value(unknowns, vector, cov)).tolist()
    return Identifiability(
        names=unknowns.labels, rank=rank, singular_values=values, null_directions=null,
        unsure=tuple(unsure), valley=valley(unknowns, vector, null, cost),
    )  # fmt: skip
