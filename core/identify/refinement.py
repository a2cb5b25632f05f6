"""Bounded least-squares refinement with sensitivities."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from core.identify.residuals import Residuals
from core.progress import StoppedError

MOST_EVALUATIONS = 60
TOLERANCE = 1e-14
"""Relative; the cost of noise-free data falls by twenty orders, so this is meant to be small."""

DEAR_TOLERANCE = 1e-8
"""Where simulations are dear: still far below any standard deviation of an estimate."""


@dataclass(frozen=True)
class Refined:
    """Where the descent ended."""

    vector: np.ndarray
    cost: float
    """Sum of weighted squares, without the priors."""
    gradient: float
    """|J'r| of the scaled problem over |J||r|: the cosine of residual and sensitivities."""
    converged: bool
    stopped_at_once: bool = False
    """Whether somebody stopped before the first step was done."""
    slopes: tuple[np.ndarray, ...] = ()
    """The residuals' sensitivities (M, k, P) there, where the last step has found them."""


class Prior:
    """Rows (theta - mean)/std appended to the residuals, in units of the residuals' own level.

    With N counted samples and noise of unknown level the likelihood is N log V; its quadratic
    approximation around a cost V has the noise variance V / N, which is what scales the rows.
    """

    def __init__(self, residuals: Residuals) -> None:
        items = residuals.unknowns.parameters.items
        self.at = np.array([i for i, p in enumerate(items) if p.prior_std is not None], dtype=int)
        means = [
            items[i].value if items[i].prior_mean is None else items[i].prior_mean for i in self.at
        ]
        self.mean = np.array(means, dtype=float)
        self.std = np.array([items[i].prior_std for i in self.at], dtype=float)
        self.count = residuals.count
        self.size = len(items)

    def misfit(self, vectors: np.ndarray) -> np.ndarray:
        """(S,) sum of squared standardised deviations."""
        return np.asarray(np.sum(((vectors[:, self.at] - self.mean) / self.std) ** 2, axis=1))

    def factor(self, vectors: np.ndarray) -> np.ndarray:
        """(S,) by which the likelihood's cost V grows: exp(misfit / N)."""
        return np.exp(self.misfit(vectors) / self.count)

    def rows(self, vector: np.ndarray, level: float) -> np.ndarray:
        """Residuals of the prior, weighted like those of the data."""
        return level * (vector[self.at] - self.mean) / self.std

    def jacobian(self, level: float) -> np.ndarray:
        """Their slopes by the unknowns (rows, unknowns)."""
        out = np.zeros((len(self.at), self.size))
        out[np.arange(len(self.at)), self.at] = level / self.std
        return out


ROUNDS_WITH_PRIOR = 3
"""The noise level that scales the prior settles in two; the third confirms."""


OnStep = Callable[[float], bool]
"""Called with the cost after each step; True ends the descent where it is."""


def refine(
    residuals: Residuals, start: np.ndarray, on_step: OnStep, tolerance: float | None = None
) -> Refined:
    """The least-squares minimum reached from `start` within the bounds; `tolerance` is relative
    and about the cost, and as strict as makes sense where none is given."""
    prior = Prior(residuals)
    vector = start
    for _ in range(ROUNDS_WITH_PRIOR if len(prior.at) else 1):
        level = float(np.sqrt(np.mean(residuals(vector) ** 2))) if len(prior.at) else 1.0
        try:
            found = _minimise(residuals, vector, prior, level, on_step, tolerance)
        except _StoppedAt as stop:
            return Refined(stop.vector, stop.cost, np.nan, False, not np.isfinite(stop.cost))
        vector = found.x * residuals.scales
    r, J = found.fun[: residuals.count], found.jac[: residuals.count]
    size = np.linalg.norm(J) * np.linalg.norm(r)
    gradient = float(np.linalg.norm(J.T @ r) / size) if size > 0.0 else 0.0
    return Refined(vector, float(r @ r), gradient, bool(found.status > 0))


@dataclass
class _StoppedAt(Exception):  # noqa: N818
    """Somebody stopped in the middle of a step: where the last one ended."""

    vector: np.ndarray
    cost: float


def _minimise(
    residuals: Residuals,
    start: np.ndarray,
    prior: Prior,
    level: float,
    on_step: OnStep,
    asked: float | None,
) -> scipy.optimize.OptimizeResult:
    """SciPy's result, in units of the scales; _StoppedAt where somebody stopped it."""
    parameters, scales = residuals.unknowns.parameters, residuals.scales

    def value(x: np.ndarray) -> np.ndarray:
        r = np.concatenate([residuals(x * scales), prior.rows(x * scales, level)])
        return np.where(np.isfinite(r), r, 1e100)

    def slope(x: np.ndarray) -> np.ndarray:
        J = np.vstack([residuals.jacobian(x * scales), prior.jacobian(level)])
        return np.asarray(np.nan_to_num(J * scales))

    best: list[tuple[np.ndarray, float]] = []

    def watch(intermediate_result: scipy.optimize.OptimizeResult) -> None:
        best[:] = [(np.array(intermediate_result.x), 2.0 * float(intermediate_result.cost))]
        if on_step(2.0 * float(intermediate_result.cost)):
            raise StopIteration

    tolerance = DEAR_TOLERANCE if residuals.predictor.simulation_is_dear else TOLERANCE
    tolerance = tolerance if asked is None else asked
    lower, upper = parameters.lower() / scales, parameters.upper() / scales
    begin = np.clip(start / scales, lower, upper)
    try:
        return scipy.optimize.least_squares(
            value, begin, jac=slope, bounds=(lower, upper), xtol=tolerance, ftol=tolerance,
            gtol=tolerance, max_nfev=MOST_EVALUATIONS, callback=watch,
        )  # fmt: skip
    except StoppedError:
        x, cost = best[0] if best else (begin, float("nan"))
        raise _StoppedAt(x * scales, cost) from None
