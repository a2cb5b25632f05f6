"""Bounded least squares by Levenberg-Marquardt on the normal equations.

Diagnosis fits the same kind of problem many times with few shared unknowns, one or two per
recording and tens of thousands of samples: P x P normal equations cost next to nothing beside
the simulations, where a factorisation of the whole Jacobian would cost more than they do.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from .parameters import ParameterSet

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
class Limits:
    """Bounds and typical sizes (P,), and what is known a priori: values and deviations, infinite
    where nothing is."""

    lower: np.ndarray
    upper: np.ndarray
    scales: np.ndarray
    prior_means: np.ndarray | float = 0.0
    deviations: np.ndarray | float = np.inf

    def inside(self, x: np.ndarray) -> np.ndarray:
        """(P,) bool: not at a bound, to a millionth of a typical size."""
        margin = AT_BOUND * self.scales
        return np.asarray((x > self.lower + margin) & (x < self.upper - margin))

    def prior_cost(self, x: np.ndarray) -> np.ndarray:
        """(...) squared deviations of x (..., P) from what is known a priori."""
        return np.asarray(np.sum(((x - self.prior_means) / self.deviations) ** 2, axis=-1))


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
"""Reduction of the cost per sample, in floors squared, below which an iteration is the last: with
the 100,000 samples of a long campaign it is the evidence at which two models tie."""
KEPT = 0.5
"""Of the reduction that straight lines promise: by less than this they were no straight lines."""
FLAT = 1.5
"""Of that reduction: by more than this the errors bend away from straight lines so that the cost is
less than half as curved as they say, and its minimum more than twice as far."""
SHORT = 1e-2
"""Damping above which a step was short, so that a small reduction says nothing of the next one."""
WORST_DAMPING = 1e6
SAME_START = 0.1
"""Of a typical size: nearer starts end in the same minimum, as those within some ten per cent of a
resonance do."""
AT_BOUND = 1e-6
"""Of a typical size: nearer than this a parameter stands at its bound."""
DIVERGED = 1e12
"""In floors: no simulation that holds together is that far off."""


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
        flat = S.reshape(r.size, P)  # a model may have no unknown but one, and that is held
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
    keep: bool = False,
    damping: float = FIRST_DAMPING,
    exact: Callable[[np.ndarray], Slopes] | None = None,
    share: float = 0.0,
) -> Descended:
    """The minimum reached from `start` (P,) within the bounds; `damping` of a descent that goes on.

    An iteration is the last where it reduces the cost by less than `good_enough` per sample, or by
    less than that `share` of it.

    Where rough `slopes` lead nowhere downhill, the descent goes on with the `exact` ones: of a fast
    vibration with half the steps they pointed uphill, and left a tenth of the error.

    `keep` is for a start near its minimum. Slopes hardly change there and are the expensive part.
    So they are computed again only where a step with those at hand reduced the cost by less than
    KEPT or more than FLAT of the predicted reduction. Such a step is doubled as long as the cost
    falls. A step that raises the cost is shortened only while the predicted reduction is large
    enough. Not for starts farther away: short steps were seen to gain more than the linear
    prediction there, and doubled ones to leave a limit of torque so far from its minimum that a
    soft base seemed to be missing.
    """
    x = np.clip(start, limits.lower, limits.upper)
    blocks = errors(x)
    least = good_enough * sum(b.size for b in blocks)
    cost, done, ended = cost_of(blocks), 0, False
    cost += float(limits.prior_cost(x))
    S: Slopes = ()
    at, shorter = None, keep or share > 0.0
    while done < most and len(x) and np.isfinite(cost) and not (S and stopped()):
        if at is None:
            S, at = [as_finite(s) for s in slopes(x)], x
        enough = max(least, share * cost)
        A, b = normal_equations(blocks, S)
        A[np.diag_indices_from(A)] += np.asarray(limits.deviations) ** -2.0
        b += (x - limits.prior_means) / np.asarray(limits.deviations) ** 2
        done += 1
        free = _free(x, b, limits)
        x_new, blocks_new, cost_new, damping = _step(
            errors, x, blocks, cost, A, b, free, limits, damping, enough if shorter else 0.0
        )
        promise = _reduction_of_move(A, b, x_new - x)
        bent = keep and cost - cost_new > FLAT * promise + enough
        if bent:
            x_new, blocks_new, cost_new = _longer(errors, x, x_new, blocks_new, cost_new, limits)
        reduction = cost - cost_new
        stuck = np.array_equal(x, x_new)
        poor = stuck or bent or reduction < KEPT * promise
        if stuck and exact is not None and np.any(free):
            slopes, exact, at, damping, shorter = exact, None, None, FIRST_DAMPING, True
            continue
        resting = stuck or (reduction < enough and damping < SHORT)
        ended = resting and (at is x or not poor)
        if not keep or poor:
            at = None
        x, blocks, cost = x_new, blocks_new, cost_new
        if ended:
            break
    S = S or [np.zeros((*b.shape, len(x))) for b in blocks]
    return Descended(x, cost_of(blocks), done, tuple(blocks), tuple(S), damping, ended)


def _reduction_of_move(A: np.ndarray, b: np.ndarray, move: np.ndarray) -> float:
    """Reduction of the cost by a move (P,) where the errors are straight lines."""
    return -float(2.0 * b @ move + move @ A @ move)


def predicted_reduction(descended: Descended, limits: Limits) -> float:
    """Reduction of the cost that one more step promises where the errors are straight lines along
    the slopes last taken."""
    if not len(descended.vector):
        return 0.0
    A, b, x = *normal_equations(descended.blocks, descended.slopes), descended.vector
    A[np.diag_indices_from(A)] += np.asarray(limits.deviations) ** -2.0
    b += (x - limits.prior_means) / np.asarray(limits.deviations) ** 2
    move = _inside(x, _move(A, b, _free(x, b, limits), FIRST_DAMPING), limits) - x
    return max(_reduction_of_move(A, b, move), 0.0)


def as_finite(S: np.ndarray) -> np.ndarray:
    """S with zeros for what is not finite, where a simulation diverged."""
    return S if np.all(np.abs(S) < DIVERGED) else np.nan_to_num(S, nan=0.0, posinf=0.0, neginf=0.0)


def _free(x: np.ndarray, b: np.ndarray, limits: Limits) -> np.ndarray:
    """(P,) bool: not held by a bound that the descent pushes against; the errors fall along -b."""
    margin = AT_BOUND * limits.scales
    bound = ((x <= limits.lower + margin) & (b > 0.0)) | ((x >= limits.upper - margin) & (b < 0.0))
    return ~bound


FIRST_WAY = 0.9
"""Of the distance to a bound, that a step which would cross it takes: at a bound an effect may
have no slope left (a lag far below the sample time), and a descent that jumps there stays."""

NEAR = 0.05
"""Of a typical size: from here on a step may go all the way."""


def _inside(x: np.ndarray, move: np.ndarray, limits: Limits) -> np.ndarray:
    """x + move within the bounds."""
    low, high, margin = limits.lower, limits.upper, NEAR * limits.scales
    low = np.where(x - low > margin, x - FIRST_WAY * (x - low), low)
    high = np.where(high - x > margin, x + FIRST_WAY * (high - x), high)
    return np.clip(x + move, low, high)


def _step(  # type: ignore[no-untyped-def]
    errors, x, blocks, cost, A, b, free, limits: Limits, damping: float, enough: float
):
    """One accepted step with its damping; the point itself where no step reduces the cost.

    A step that increases the cost is shortened while its predicted reduction exceeds `enough`.
    """
    while damping < WORST_DAMPING and np.any(free & (np.diag(A) > 0.0)):
        move = _move(A, b, free, damping)
        x_new = _inside(x, move, limits)
        new_blocks = errors(x_new)
        new = cost_of(new_blocks) + float(limits.prior_cost(x_new))
        if new < cost:
            return x_new, new_blocks, new, max(0.1 * damping, 1e-9)
        if np.isfinite(new) and _reduction_of_move(A, b, move) < enough:
            break  # shorter ones promise less
        damping = max(10.0 * damping, 1e-3)
    return x, blocks, cost, damping


def _longer(errors, x, x_new, blocks, cost: float, limits: Limits):  # type: ignore[no-untyped-def]
    """The step from x to x_new, doubled as long as that goes down."""
    while True:
        x_longer = _inside(x, 2.0 * (x_new - x), limits)
        new_blocks = errors(x_longer)
        new = cost_of(new_blocks) + float(limits.prior_cost(x_longer))
        if not new < cost:
            return x_new, blocks, cost
        x_new, blocks, cost = x_longer, new_blocks, new


SEEN = 1e-10
"""Of the largest eigenvalue of the scaled normal equations: directions with less of it do not
move, since differences cannot separate their slopes from rounding."""


_SMALLEST = 1e-200
"""A square below it comes from what has died out: that direction stays zero."""


def pseudo_inverse(A: np.ndarray, relative: float = SEEN) -> np.ndarray:
    """Inverse of normal equations (P, P), scaled by their diagonal, on the directions whose
    `relative` eigenvalue is larger."""
    if not len(A):
        return A
    diagonal = np.diag(A)
    d = np.sqrt(np.where(diagonal > _SMALLEST, diagonal, 1.0))
    values, vectors = np.linalg.eigh(A / np.outer(d, d))
    kept = values > relative * values.max()
    inner = (vectors[:, kept] / values[kept]) @ vectors[:, kept].T
    return np.asarray(inner / np.outer(d, d))


def _move(A: np.ndarray, b: np.ndarray, free: np.ndarray, damping: float) -> np.ndarray:
    """(P,) Levenberg's step of what is free and moves any output."""
    scale = np.sqrt(np.maximum(np.diag(A), 1e-300))
    inside = np.flatnonzero(free & (np.diag(A) > 0.0))
    move = np.zeros_like(b)
    if len(inside):
        normal = (A / np.outer(scale, scale))[np.ix_(inside, inside)]
        sizes, directions = np.linalg.eigh(normal)
        directions, sizes = directions[:, sizes > SEEN * sizes[-1]], sizes[sizes > SEEN * sizes[-1]]
        along = directions.T @ (b / scale)[inside] / (sizes + damping)
        move[inside] = -directions @ along
    return move / scale
