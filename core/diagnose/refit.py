"""Full refits of the most promising candidates."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..diagnose.fit_problem import Data, Hypothesis, again, hypothesis
from ..diagnose.refit_starts import ROUGH_ITERATIONS, starts
from ..diagnose.whitening import Whitener
from ..effects.effect import Effect
from ..identify.uncertainty import NOTHING, covariance
from ..least_squares import (
    FIRST_DAMPING,
    Descended,
    cost_of,
    descend,
    normal_equations,
    pseudo_inverse,
)


@dataclass(frozen=True)
class Refit:
    """A model fitted with one more effect."""

    hypothesis: Hypothesis
    """At its fitted vector."""
    descended: Descended
    white_cost: float
    """Whitened squared error at its own minimum."""
    covariance: np.ndarray
    """(P, P), from the whitened information; that of the plain minimum once `settled`."""

    @property
    def cost(self) -> float:
        """Weighted sum of squares where the descent ended."""
        return self.descended.cost

    @property
    def errors(self) -> tuple[np.ndarray, ...]:
        """Weighted residuals of each recording."""
        return self.descended.blocks


Known = Mapping[str, tuple[np.ndarray, ...]]
"""label -> the column (M, k) per recording of an unknown's slopes."""


def fit(
    start: Hypothesis,
    whitener: Whitener | None,
    stopped: Callable[[], bool],
    most: int,
    known: Known | None = None,
    damping: float = FIRST_DAMPING,
    exactly_downhill: bool = False,
) -> Refit:
    """Descends from where the hypothesis stands; then the whitened minimum by one linear step.

    Slopes that are `known` are not taken again: nuisance columns hardly change with an effect,
    and a descent needs only their direction. `exactly_downhill`: where such directions lead
    nowhere, exact ones are taken.
    """
    found = descend(
        start.errors,
        lambda x: start.slopes_with(x, known or {}),
        start.vector,
        start.limits,
        stopped,
        most=most,
        damping=damping,
        exact=start.exact_slopes if exactly_downhill else None,
    )
    at = start.at(found.vector)
    if whitener is None or not len(found.vector):
        P = len(found.vector)
        return Refit(at, found, found.cost, np.full((P, P), np.nan))
    white, covariance = whitened(at, found, whitener)
    return Refit(at, found, white, covariance)


def whitened(at: Hypothesis, found: Descended, whitener: Whitener) -> tuple[float, np.ndarray]:
    """Least whitened squared error near a minimum, and the covariance there.

    Parameters at a bound stay there.
    """
    slopes = [whitener(i, s) for i, s in enumerate(found.slopes)]
    blocks = [whitener(i, b) for i, b in enumerate(found.blocks)]
    A, b = normal_equations(blocks, slopes)
    cost = float(sum(np.sum(x * x) for x in blocks))
    which = np.flatnonzero(at.limits.inside(found.vector) & (np.diag(A) > 0.0))
    inverse = pseudo_inverse(A[np.ix_(which, which)])
    covariance = np.full(A.shape, np.nan)
    covariance[np.ix_(which, which)] = inverse
    return cost - float(b[which] @ inverse @ b[which]), covariance


def refit_with(
    data: Data,
    base: Hypothesis,
    effects: Sequence[Effect],
    values: Mapping[str, float],
    whitener: Whitener,
    slopes: Sequence[np.ndarray],
    scanned: Sequence[str],
    stopped: Callable[[], bool],
    most: int = ROUGH_ITERATIONS,
) -> Refit:
    """Fits the model with `effects` from the most promising of some starts.

    They race coarsely: which is ahead shows without the last digit, and there are several.

    `slopes` are the base's, (M, k, P) per recording; the parameters `scanned` have no slope at
    neutral.
    """
    start, spent = ahead(data, base, effects, values, slopes, scanned, stopped)
    known = columns_of(base, slopes)
    return exactly(data, fit(start, None, stopped, most - spent, known), whitener)


def ahead(
    data: Data,
    base: Hypothesis,
    effects: Sequence[Effect],
    values: Mapping[str, float],
    slopes: Sequence[np.ndarray],
    scanned: Sequence[str],
    stopped: Callable[[], bool],
) -> tuple[Hypothesis, int]:
    """The start that leads further, and the iterations that were spent on it."""
    begun = starts(data, base, effects, values, scanned, stopped)
    tried = [hypothesis(data, effects, start) for start in begun]
    if len(tried) < 2 or stopped():
        return tried[0], 0
    known = columns_of(base, slopes)
    looks = [fit(h.coarse, None, stopped, LOOK, known) for h in tried]
    best = min(range(len(tried)), key=lambda k: looks[k].cost)
    return tried[best].at(looks[best].hypothesis.vector), LOOK


EXACT = 2
"""Times as many steps per sample for what is compared: no candidate may win by its steps."""


def exactly(data: Data, rough: Refit, whitener: Whitener) -> Refit:
    """The refit with its errors simulated finely, as those of the base are."""
    h = rough.hypothesis
    fine = again(data, h, finer=EXACT)
    blocks = tuple(fine.errors(h.vector))
    cost = cost_of(blocks)
    found = replace(rough.descended, blocks=blocks, cost=cost)
    if not np.isfinite(cost):
        return replace(rough, descended=found)
    white, covariance = whitened(h, found, whitener)
    return Refit(h, found, white, covariance)


def columns_of(base: Hypothesis, slopes: Sequence[np.ndarray]) -> Known:
    """The nuisance columns of the base's slopes (M, k, P) per recording."""
    return {
        label: tuple(S[:, :, j] for S in slopes) for j, label in enumerate(base.unknowns.labels)
    }


LOOK = 2
"""Iterations from each start or of each candidate before what is behind stops: the first goes to
where straight lines lead, the second shows how far that was right."""


def settled(found: Refit) -> Refit:
    """With the deviations that a reader is told."""
    return replace(found, covariance=robust_covariance(found))


def robust_covariance(
    found: Refit, relative: float = NOTHING, released: bool = False
) -> np.ndarray:
    """(P, P) of a least-squares minimum under coloured noise; NaN for what sits at a bound, unless
    the bounds are `released`.

    The estimate is the plain minimum, so its covariance is the sandwich of the noise's own
    covariances (core.identify.uncertainty), not the inverse of the whitened information. It is zero
    along directions whose `relative` eigenvalue of the normal equations is smaller.
    """
    h, x = found.hypothesis, found.hypothesis.vector
    inside = np.flatnonzero(h.limits.inside(x) | released)
    slopes = [S[:, :, inside] for S in found.descended.slopes]
    out = np.full((len(x), len(x)), np.nan)
    if len(inside):
        out[np.ix_(inside, inside)] = covariance(slopes, found.errors, len(inside), relative)
    return out
