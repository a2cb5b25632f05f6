"""Bounded least-squares refinement with sensitivities."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from core.identify.residuals import Residuals
from core.least_squares import Descended, cost_of, descend, limits_of
from core.progress import StoppedError

MOST_ITERATIONS = 60
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


ROUNDS_WITH_PRIOR = 3
"""The noise level that scales the prior settles in two; the third confirms."""


OnStep = Callable[[float], bool]
"""Called with the cost after each step; True ends the descent where it is."""


def refine(
    residuals: Residuals, start: np.ndarray, on_step: OnStep, tolerance: float | None = None
) -> Refined:
    """The least-squares minimum reached from `start` within the bounds; `tolerance` is relative
    and about the cost, and as strict as makes sense where none is given."""
    if tolerance is None:
        tolerance = DEAR_TOLERANCE if residuals.predictor.simulation_is_dear else TOLERANCE
    limits = limits_of(residuals.unknowns.parameters)
    stated, vector = np.asarray(limits.deviations), np.asarray(start, dtype=float)
    watched = _Watched(residuals, on_step)
    with_prior = bool(np.isfinite(stated).any())
    for _ in range(ROUNDS_WITH_PRIOR if with_prior else 1):
        # Rows of the prior in units of the residuals' own level.
        level = float(np.sqrt(np.mean(residuals(vector) ** 2))) if with_prior else 1.0
        limits = replace(limits, deviations=stated / (level or 1.0))
        try:
            found = descend(
                watched.errors, watched.slopes, vector, limits, watched.stopped,
                MOST_ITERATIONS, 0.0, share=tolerance,
            )  # fmt: skip
        except StoppedError:
            return Refined(watched.vector, watched.cost, np.nan, False, watched.cost == np.inf)
        vector = found.vector
    return Refined(vector, found.cost, _cosine(found, residuals.scales), found.ended)


def _cosine(found: Descended, scales: np.ndarray) -> float:
    r, J = found.blocks[0], found.slopes[0] * scales
    size = np.linalg.norm(J) * np.linalg.norm(r)
    return float(np.linalg.norm(J.T @ r) / size) if size > 0.0 else 0.0


@dataclass
class _Watched:
    """Residuals and slopes for a descent, and the best that it has come to."""

    residuals: Residuals
    on_step: OnStep
    vector: np.ndarray = field(default_factory=lambda: np.zeros(0))
    cost: float = np.inf

    def errors(self, x: np.ndarray) -> list[np.ndarray]:
        r = self.residuals(x)
        cost = cost_of([r])
        if cost < self.cost or not self.vector.size:
            self.vector, self.cost = np.array(x), cost
        return [r]

    def slopes(self, x: np.ndarray) -> list[np.ndarray]:
        return [self.residuals.jacobian(x)]

    def stopped(self) -> bool:
        return self.on_step(self.cost)
