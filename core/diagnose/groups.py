"""Effects that the data cannot tell apart: parallel directions whose refits tie."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.diagnose.evidence import TIE, Weighed
from core.diagnose.screen import Screen, Screened

PARALLEL = 0.95
"""|cos| of the smallest principal angle between projected directions from which on two effects
are said to be confusable."""

MOST_MEMBERS = 3


def confused_with(
    best: Weighed, found: Sequence[Weighed], seen: Screen, included: Sequence[str] = ()
) -> tuple[str, ...]:
    """Ids of the effects that the data cannot tell from `best`.

    What an effect includes does not compete with it: the simpler one is preferred as such.
    """
    competitors = []
    for other in found:
        kind = other.screened.effect.kind
        if other is best or kind in included:
            continue
        alike = parallel(seen, best.screened, other.screened) > PARALLEL
        apart = abs(best.delta_bic - other.delta_bic)
        if alike and apart < TIE:
            competitors.append((apart, kind))
    return tuple(kind for _, kind in sorted(competitors)[: MOST_MEMBERS - 1])


def parallel(seen: Screen, a: Screened, b: Screened) -> float:
    """Cosine of the smallest principal angle between two candidates' whitened directions."""
    W = seen.white.projected()
    A, B = list(a.columns), list(b.columns)
    if not A or not B:
        return 0.0
    half_a, half_b = _inverse_root(W[np.ix_(A, A)]), _inverse_root(W[np.ix_(B, B)])
    between = half_a.T @ W[np.ix_(A, B)] @ half_b
    return float(min(np.linalg.svd(between, compute_uv=False)[0], 1.0)) if between.size else 0.0


def _inverse_root(A: np.ndarray) -> np.ndarray:
    """X with X' A X = I on the directions that are there."""
    d = np.sqrt(np.maximum(np.diag(A), 1e-300))
    values, vectors = np.linalg.eigh(A / np.outer(d, d))
    kept = values > 1e-9 * values.max()
    return np.asarray((vectors[:, kept] / np.sqrt(values[kept])) / d[:, None])
