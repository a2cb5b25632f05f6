"""Full refits of the most promising candidates."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from core.diagnose.data import Data, Hypothesis, hypothesis
from core.diagnose.descent import Descended, descend, normal_equations
from core.diagnose.whitening import Whitener
from core.effects.effect import Effect

ROUGH_ITERATIONS = 6
"""Enough to rank; the accepted one is polished afterwards."""


@dataclass(frozen=True)
class Refit:
    """A model fitted with one more effect."""

    hypothesis: Hypothesis
    """At its fitted vector."""
    descended: Descended
    white_cost: float
    """Whitened squared error at its own minimum."""
    covariance: np.ndarray
    """(P, P), from the whitened information."""

    @property
    def cost(self) -> float:
        return self.descended.cost

    @property
    def errors(self) -> tuple[np.ndarray, ...]:
        return self.descended.blocks


Known = Mapping[str, tuple[np.ndarray, ...]]
"""label -> the column (M, k) per recording of an unknown's slopes."""


def fit(
    start: Hypothesis,
    whitener: Whitener | None,
    stopped: Callable[[], bool],
    most: int,
    known: Known | None = None,
) -> Refit:
    """Descends from where the hypothesis stands; then the whitened minimum by one linear step.

    Slopes that are `known` are not taken again: nuisance columns hardly change with an effect,
    and a descent needs only their direction.
    """
    found = descend(
        start.errors,
        lambda x: start.slopes_with(x, known or {}),
        start.vector,
        start.limits,
        stopped,
        most=most,
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
    slopes = [whitener(s) for s in found.slopes]
    blocks = [whitener(b) for b in found.blocks]
    A, b = normal_equations(blocks, slopes)
    cost = float(sum(np.sum(x * x) for x in blocks))
    limits, x = at.limits, found.vector
    near = 1e-6 * limits.scales
    inside = (x > limits.lower + near) & (x < limits.upper - near) & (np.diag(A) > 0.0)
    which = np.flatnonzero(inside)
    d = np.sqrt(np.diag(A)[which])
    inverse = np.linalg.pinv(A[np.ix_(which, which)] / np.outer(d, d), rcond=1e-10, hermitian=True)
    g = b[which] / d
    covariance = np.full(A.shape, np.nan)
    covariance[np.ix_(which, which)] = inverse / np.outer(d, d)
    return cost - float(g @ inverse @ g), covariance


def refit_with(
    data: Data,
    base: Hypothesis,
    effects: Sequence[Effect],
    values: Mapping[str, float],
    whitener: Whitener,
    slopes: Sequence[np.ndarray],
    stopped: Callable[[], bool],
    most: int = ROUGH_ITERATIONS,
) -> Refit:
    """Fits the model with `effects` from the base's nuisance and from the prior nominals.

    The base fit may have bent the nominal parameters to swallow the effect, and a descent from
    there can stick (design section 6, 1). `slopes` are the base's, (M, k, P) per recording.
    """
    fitted = {**base.values(), **values}
    near, known = hypothesis(data, effects, fitted), columns_of(base, slopes)
    nominal = {u.label: u.parameter.value for u in data.nuisance if u.recording is None}
    apart = any(abs(base.values()[k] - v) > NOMINAL_MOVED * abs(v) for k, v in nominal.items())
    if not apart or stopped():
        return fit(near, whitener, stopped, most, known)
    far = hypothesis(data, effects, {**fitted, **nominal})
    first, second = (fit(h, None, stopped, LOOK, known) for h in (near, far))
    ahead = first if first.cost <= second.cost else second
    return fit(ahead.hypothesis, whitener, stopped, most - LOOK, known)


def columns_of(base: Hypothesis, slopes: Sequence[np.ndarray]) -> Known:
    """The nuisance columns of the base's slopes (M, k, P) per recording."""
    return {
        label: tuple(S[:, :, j] for S in slopes) for j, label in enumerate(base.unknowns.labels)
    }


LOOK = 2
"""Iterations from each start before the one that is ahead goes on alone."""

NOMINAL_MOVED = 0.02
"""Share by which a nominal parameter must have moved for a second start to be worth it."""
