"""Bounded least squares by Levenberg-Marquardt on the normal equations.

Diagnosis fits the same kind of problem many times with few shared unknowns, one or two per
recording and tens of thousands of samples: P x P normal equations cost next to nothing beside
the simulations, where a factorisation of the whole Jacobian would cost more than they do.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from core.parameters import ParameterSet

Blocks = Sequence[np.ndarray]
"""Weighted errors (M, k) per recording."""
Slopes = Sequence[np.ndarray]
"""Their derivatives (M, k, P) per recording."""


@dataclass(frozen=True)
class Descended:
    """Where a descent ended."""

    vector: np.ndarray
    cost: float
    gradient: float
    """Cosine of the residual and the sensitivities of what is free: zero at a minimum."""
    iterations: int
    blocks: tuple[np.ndarray, ...]
    """The weighted errors there."""
    slopes: tuple[np.ndarray, ...]
    """Their derivatives (M, k, P) where they were last taken: one step before."""


@dataclass(frozen=True)
class Limits:
    """Bounds and typical sizes (P,), and what is known beforehand: values and deviations, infinite
    where nothing is."""

    lower: np.ndarray
    upper: np.ndarray
    scales: np.ndarray
    believed: np.ndarray | float = 0.0
    deviations: np.ndarray | float = np.inf

    def surprise(self, x: np.ndarray) -> float:
        """Squared deviations from what is known beforehand."""
        return float(np.sum(((x - self.believed) / self.deviations) ** 2))


def limits_of(parameters: ParameterSet) -> Limits:
    """Those of a set of parameters; a prior's mean is the parameter's value."""
    stds = [np.inf if p.prior_std is None else p.prior_std for p in parameters]
    means = [p.prior_mean if p.prior_mean is not None else p.value for p in parameters]
    return Limits(
        parameters.lower(), parameters.upper(), parameters.scales(), np.array(means, dtype=float),
        np.array(stds, dtype=float),
    )  # fmt: skip


MOST_ITERATIONS = 15
GOOD_ENOUGH = 1e-4
"""Fall of the cost per sample, in floors squared, below which an iteration is the last: with the
100,000 samples of a long campaign it is the evidence at which two models tie."""
SHORT = 1e-2
"""Damping above which a step was short, so that a small fall says nothing of the next one."""
FIRST_DAMPING = 1e-4
WORST_DAMPING = 1e6
AT_BOUND = 1e-9
ASTRAY = 1e12
"""In floors: no simulation that holds together is that far off."""


def cost_of(blocks: Blocks) -> float:
    """Sum of squares; infinite where a simulation went astray."""
    if not all(np.all(np.abs(b) < ASTRAY) for b in blocks):
        return np.inf
    return float(sum(np.sum(b * b) for b in blocks))


def normal_equations(blocks: Blocks, slopes: Slopes) -> tuple[np.ndarray, np.ndarray]:
    """J'J (P, P) and J'r (P,)."""
    P = slopes[0].shape[2]
    A, b = np.zeros((P, P)), np.zeros(P)
    for r, S in zip(blocks, slopes, strict=True):
        flat = S.reshape(-1, P)
        A += flat.T @ flat
        b += flat.T @ r.ravel()
    return A, b


def descend(
    errors: Callable[[np.ndarray], Blocks],
    slopes: Callable[[np.ndarray], Slopes],
    start: np.ndarray,
    limits: Limits,
    stopped: Callable[[], bool] = lambda: False,
    most: int = MOST_ITERATIONS,
    good_enough: float = GOOD_ENOUGH,
) -> Descended:
    """The minimum reached from `start` (P,) within the bounds."""
    x = np.clip(start, limits.lower, limits.upper)
    blocks = errors(x)
    enough = good_enough * sum(b.size for b in blocks)
    cost, damping, gradient, done = cost_of(blocks), FIRST_DAMPING, np.nan, 0
    cost += limits.surprise(x)
    S: Slopes = ()
    while done < most and len(x) and np.isfinite(cost) and not (S and stopped()):
        S = [whole(s) for s in slopes(x)]
        A, b = normal_equations(blocks, S)
        A[np.diag_indices_from(A)] += np.asarray(limits.deviations) ** -2.0
        b += (x - limits.believed) / np.asarray(limits.deviations) ** 2
        done += 1
        free = _free(x, b, limits)
        gradient = _cosine(A, b * free, cost)
        x_new, blocks_new, cost_new, damping = _step(
            errors, x, blocks, cost, A, b, free, limits, damping
        )
        fall = cost - cost_new
        stuck = np.array_equal(x, x_new)
        x, blocks, cost = x_new, blocks_new, cost_new
        if stuck or (fall < enough and damping < SHORT):
            break
    S = S or [np.zeros((*b.shape, len(x))) for b in blocks]
    return Descended(x, cost_of(blocks), gradient, done, tuple(blocks), tuple(S))


def whole(S: np.ndarray) -> np.ndarray:
    """A simulation that went astray beside the point shows no direction."""
    return S if np.all(np.abs(S) < ASTRAY) else np.nan_to_num(S, nan=0.0, posinf=0.0, neginf=0.0)


def _free(x: np.ndarray, b: np.ndarray, limits: Limits) -> np.ndarray:
    """(P,) bool: not held by a bound that the descent pushes against; the errors fall along -b."""
    near = AT_BOUND * limits.scales
    held = ((x <= limits.lower + near) & (b > 0.0)) | ((x >= limits.upper - near) & (b < 0.0))
    return ~held


def _cosine(A: np.ndarray, b: np.ndarray, cost: float) -> float:
    size = np.sqrt(np.maximum(np.diag(A), 1e-300) * max(cost, 1e-300))
    return float(np.max(np.abs(b) / size)) if len(b) else 0.0


FIRST_WAY = 0.9
"""Of the distance to a bound, that a step which would cross it takes: at a bound an effect may
have no slope left (a lag far below the sample time), and a descent that jumps there stays."""

NEAR = 0.05
"""Of a typical size: from here on a step may go all the way."""


def _inside(x: np.ndarray, move: np.ndarray, limits: Limits) -> np.ndarray:
    """x + move within the bounds."""
    low, high, near = limits.lower, limits.upper, NEAR * limits.scales
    low = np.where(x - low > near, x - FIRST_WAY * (x - low), low)
    high = np.where(high - x > near, x + FIRST_WAY * (high - x), high)
    return np.clip(x + move, low, high)


def _step(  # type: ignore[no-untyped-def]
    errors, x, blocks, cost, A, b, free, limits: Limits, damping: float
):
    """One accepted step with the damping it needed; the point itself where none is downhill."""
    scale = np.sqrt(np.maximum(np.diag(A), 1e-300))
    inside = np.flatnonzero(free & (np.diag(A) > 0.0))
    normal = (A / np.outer(scale, scale))[np.ix_(inside, inside)]
    right = (b / scale)[inside]
    while damping < WORST_DAMPING and len(inside):
        move = np.zeros_like(x)
        move[inside] = -np.linalg.solve(normal + damping * np.eye(len(inside)), right)
        tried = _inside(x, move / scale, limits)
        found = errors(tried)
        new = cost_of(found) + limits.surprise(tried)
        if new < cost:
            return tried, found, new, max(0.1 * damping, 1e-9)
        damping = max(10.0 * damping, 1e-3)
    return x, blocks, cost, damping
