"""Bounded least squares by the method of Levenberg (1944) and Marquardt (1963) on the normal
equations.

Diagnosis fits the same kind of problem many times with few shared unknowns, one or two per
recording and tens of thousands of samples: P x P normal equations cost next to nothing beside
the simulations, where a factorisation of the whole Jacobian would cost more than they do.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from .parameters import AT_BOUND, ParameterSet

Blocks = Sequence[np.ndarray]
"""Weighted errors (M, k) per recording."""
Slopes = Sequence[np.ndarray]
"""Their derivatives (M, k, P) per recording."""

FIRST_DAMPING = 1e-4


@dataclass(frozen=True)
class Descended:
    """Where a descent ended."""

    vector: np.ndarray
    cost: float
    iterations: int
    blocks: tuple[np.ndarray, ...]
    """The weighted errors there."""
    slopes: tuple[np.ndarray, ...]
    """Their derivatives (M, k, P) where they were last taken: one step before."""
    damping: float = FIRST_DAMPING
    """With which it would go on."""
    ended: bool = True
    """Whether it came to its end; False where it was allowed no further step."""


@dataclass(frozen=True)
class BoundsAndPrior:
    """Bounds and typical sizes (P,), and what is known a priori: values and deviations, infinite
    where nothing is."""

    lower: np.ndarray
    upper: np.ndarray
    scales: np.ndarray
    prior_means: np.ndarray | float = 0.0
    deviations: np.ndarray | float = np.inf

    def inside(self, x: np.ndarray) -> np.ndarray:
        """(P,) bool: where x (P,) is not at a bound."""
        margin = AT_BOUND * self.scales
        return np.asarray((x > self.lower + margin) & (x < self.upper - margin))

    def prior_cost(self, x: np.ndarray) -> np.ndarray:
        """(...) squared deviations of x (..., P) from what is known a priori."""
        return np.asarray(np.sum(((x - self.prior_means) / self.deviations) ** 2, axis=-1))

    def prior_measurements(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(P,) each: errors of what is known a priori, as measurements of x (P,), and their
        slopes; zero where nothing is."""
        slopes = np.broadcast_to(1.0 / np.asarray(self.deviations), len(x))
        return (x - self.prior_means) * slopes, slopes


def bounds_and_prior(parameters: ParameterSet) -> BoundsAndPrior:
    """Those of a set of parameters; a prior's mean is the parameter's value."""
    stds = [np.inf if p.prior_std is None else p.prior_std for p in parameters]
    means = [p.prior_mean if p.prior_mean is not None else p.value for p in parameters]
    return BoundsAndPrior(
        parameters.lower(), parameters.upper(), parameters.scales(), np.array(means, dtype=float),
        np.array(stds, dtype=float),
    )  # fmt: skip


MOST_ITERATIONS = 60
"""Of a descent; most end after ten."""
GOOD_ENOUGH = 1e-4
"""Reduction of the cost per sample, in floors squared, below which an iteration is the last: with
the 100,000 samples of a long campaign it is the evidence at which two models tie."""
WORST_DAMPING = 1e6
SAME_START = 0.1
"""Of a typical size: nearer starts end in the same minimum, as those within some ten per cent of a
resonance do."""
DIVERGED = 1e9
"""In floors, or spreads of what was measured: no simulation that holds together is that far off."""


def cost_of(blocks: Blocks) -> float:
    """Sum of squares; infinite where a simulation diverged."""
    if not all(np.all(np.abs(b) < DIVERGED) for b in blocks):
        return np.inf
    return float(sum(np.sum(b * b) for b in blocks))


def normal_equations(blocks: Blocks, slopes: Slopes) -> tuple[np.ndarray, np.ndarray]:
    """J'J (P, P) and J'r (P,) of errors (..., ) and their slopes (..., P) per recording."""
    P = slopes[0].shape[-1]
    A, b = np.zeros((P, P)), np.zeros(P)
    for r, S in zip(blocks, slopes, strict=True):
        own, flat = moving_columns(S)
        A[np.ix_(own, own)] += flat.T @ flat
        b[own] += flat.T @ r.ravel()
    return A, b


def zero_slopes(shape: tuple[int, ...], P: int) -> np.ndarray:
    """(*shape, P) zeros. A column lies in one piece: with gaps it would take longer to fill, and
    columns that stay zero take no memory."""
    return np.moveaxis(np.zeros((P, *shape)), 0, -1)


def moving_columns(S: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which columns of S (..., P) are not zero, and these (rows, p). A recording's errors do not
    depend on the first states of the others: of hundreds of recordings most columns are zero."""
    own = np.flatnonzero(S.any(axis=tuple(range(S.ndim - 1))))
    kept = S if len(own) == S.shape[-1] else S[..., own]
    return own, kept.reshape(math.prod(S.shape[:-1]), len(own))


def triangular(slopes: Slopes) -> np.ndarray:
    """(R, P) with the singular values and directions of all slopes (..., P) together, of few rows:
    the triangles of their QR factors."""
    P, parts = slopes[0].shape[-1], list[np.ndarray]()
    for S in slopes:
        own, flat = moving_columns(S)
        factor = np.linalg.qr(flat, mode="r")
        parts.append(np.zeros((len(factor), P)))
        parts[-1][:, own] = factor
    return np.vstack(parts)


def levenberg_marquardt(
    errors: Callable[[np.ndarray], Blocks],
    slopes: Callable[[np.ndarray], Slopes],
    start: np.ndarray,
    limits: BoundsAndPrior,
    stopped: Callable[[], bool] = lambda: False,
    most: int = MOST_ITERATIONS,
    good_enough: float = GOOD_ENOUGH,
    damping: float = FIRST_DAMPING,
    exact: Callable[[np.ndarray], Slopes] | None = None,
    share: float = 0.0,
) -> Descended:
    """The minimum reached from `start` (P,) within the bounds; `damping` of a descent that goes on.

    An iteration is the last where its reduction of the cost, and what a step without damping would
    have added to it, are less than `good_enough` per sample, or than that `share` of the cost.

    With a `share`, a step that raises the cost is shortened only while it promises that much.

    Where rough `slopes` lead nowhere downhill, the descent goes on with the `exact` ones: of a fast
    vibration with half the steps they pointed uphill, and left a tenth of the error.
    """
    x = np.clip(start, limits.lower, limits.upper)
    blocks = errors(x)
    least = good_enough * sum(b.size for b in blocks)
    cost, done, ended = cost_of(blocks), 0, False
    cost += float(limits.prior_cost(x))
    S: Slopes = ()
    stuck, shorter = False, share > 0.0
    while done < most and len(x) and np.isfinite(cost) and not (S and stopped()):
        if not stuck:
            S = [as_finite(s) for s in slopes(x)]
        enough = max(least, share * cost)
        A, b = with_prior(*normal_equations(blocks, S), x, limits)
        done += 1
        before, first_damping = x, damping
        x, blocks, cost_new, damping = _step(
            errors, x, blocks, cost, A, b, limits, damping, enough if shorter else 0.0
        )
        reduction, cost, stuck = cost - cost_new, cost_new, np.array_equal(before, x)
        if stuck and first_damping > FIRST_DAMPING:
            damping = FIRST_DAMPING  # short steps alone were tried
            continue
        if stuck and exact is not None:
            slopes, exact, stuck, damping, shorter = exact, None, False, FIRST_DAMPING, True
            continue
        left = _predicted_by_full_step(A, b, before, limits) - _reduction_of_move(A, b, x - before)
        ended = stuck or reduction + max(left, 0.0) < enough
        if ended:
            break
    S = S or [np.zeros((*b.shape, len(x))) for b in blocks]
    return Descended(x, cost_of(blocks), done, tuple(blocks), tuple(S), damping, ended)


def with_prior(
    A: np.ndarray, b: np.ndarray, x: np.ndarray, limits: BoundsAndPrior
) -> tuple[np.ndarray, np.ndarray]:
    """Normal equations A (P, P), b (P,) with what is known a priori as measurements of x (P,)."""
    errors, slopes = limits.prior_measurements(x)
    return A + np.diag(slopes**2), b + errors * slopes


def _predicted_by_full_step(
    A: np.ndarray, b: np.ndarray, x: np.ndarray, limits: BoundsAndPrior
) -> float:
    """Reduction of the cost by a step without damping where the errors are straight lines."""
    return max(
        _reduction_of_move(A, b, _stepped(A, b, x, limits.lower, limits.upper, 0.0) - x), 0.0
    )


def _reduction_of_move(A: np.ndarray, b: np.ndarray, move: np.ndarray) -> float:
    """Reduction of the cost by a move (P,) where the errors are straight lines."""
    return -float(2.0 * b @ move + move @ A @ move)


def predicted_reduction(descended: Descended, limits: BoundsAndPrior) -> float:
    """Reduction of the cost that one more step promises where the errors are straight lines along
    the slopes last taken."""
    if not len(descended.vector):
        return 0.0
    x = descended.vector
    A, b = with_prior(*normal_equations(descended.blocks, descended.slopes), x, limits)
    return _predicted_by_full_step(A, b, x, limits)


def as_finite(S: np.ndarray) -> np.ndarray:
    """S of any shape with zeros for what is not finite, where a simulation diverged."""
    return S if np.all(np.abs(S) < DIVERGED) else np.nan_to_num(S, nan=0.0, posinf=0.0, neginf=0.0)


FIRST_WAY = 0.9
"""Of the distance to a bound, that a step which would cross it takes: at a bound an effect may
have no slope left (a lag far below the sample time), and a descent that jumps there stays."""

NEAR = 0.05
"""Of a typical size: from here on a step may go all the way."""


def _reach(x: np.ndarray, limits: BoundsAndPrior) -> tuple[np.ndarray, np.ndarray]:
    """Between which (P,) a step from x may end."""
    low, high, margin = limits.lower, limits.upper, NEAR * limits.scales
    low = np.where(x - low > margin, x - FIRST_WAY * (x - low), low)
    high = np.where(high - x > margin, x + FIRST_WAY * (high - x), high)
    return low, high


def _step(  # type: ignore[no-untyped-def]
    errors, x, blocks, cost, A, b, limits: BoundsAndPrior, damping: float, enough: float
):
    """One accepted step with its damping; the point itself where no step reduces the cost.

    A step that increases the cost is shortened while its predicted reduction exceeds `enough`.
    """
    while damping < WORST_DAMPING:
        x_new = _stepped(A, b, x, *_reach(x, limits), damping)
        if np.array_equal(x, x_new):
            break
        new_blocks = errors(x_new)
        new = cost_of(new_blocks) + float(limits.prior_cost(x_new))
        if new < cost:
            return x_new, new_blocks, new, max(0.1 * damping, 1e-9)
        if np.isfinite(new) and _reduction_of_move(A, b, x_new - x) < enough:
            break  # shorter ones promise less
        damping = max(10.0 * damping, 1e-3)
    return x, blocks, cost, damping


SEEN = 1e-10
"""Of the largest eigenvalue of the scaled normal equations: directions with less of it do not
move, since differences cannot separate their slopes from rounding."""


_SMALLEST = 1e-200
"""A square below it comes from what has died out: that direction stays zero."""


def pseudo_inverse(A: np.ndarray, relative: float = SEEN) -> np.ndarray:
    """Inverse of normal equations A (P, P), scaled by their diagonal, on the directions whose
    `relative` eigenvalue is larger."""
    if not len(A):
        return A
    diagonal = np.diag(A)
    d = np.sqrt(np.where(diagonal > _SMALLEST, diagonal, 1.0))
    values, vectors = np.linalg.eigh(A / np.outer(d, d))
    kept = values > relative * values.max()
    inner = (vectors[:, kept] / values[kept]) @ vectors[:, kept].T
    return np.asarray(inner / np.outer(d, d))


def _stepped(
    A: np.ndarray, b: np.ndarray, x: np.ndarray, low: np.ndarray, high: np.ndarray, damping: float
) -> np.ndarray:
    """(P,) after Levenberg's step, the best between `low` and `high`, of what moves any output."""
    moving, stepped = (np.diag(A) > _SMALLEST) & (low < high), x.copy()
    if np.any(moving):
        scale = np.sqrt(np.diag(A)[moving])
        sizes, directions = np.linalg.eigh(A[np.ix_(moving, moving)] / np.outer(scale, scale))
        seen = sizes > SEEN * sizes[-1]
        roots, along = np.sqrt(sizes[seen] + damping), directions[:, seen].T
        box = ((low - x)[moving] * scale, (high - x)[moving] * scale)
        goal = -(along @ (b[moving] / scale)) / roots
        move = scipy.optimize.lsq_linear(roots[:, None] * along, goal, box, method="bvls").x
        stepped[moving] += move / scale
    return np.asarray(np.clip(stepped, low, high))
