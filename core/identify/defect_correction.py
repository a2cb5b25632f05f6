"""What few steps per sample miss, taken off: the minimum that many steps would give.

A search takes few steps per sample, and what they miss is nearly the same whatever the parameters.
So it is found at one vector, where two numbers of steps are extrapolated (Richardson), and added to
the errors at all others: what is left is the change of the steps' error alone. At a minimum the
number of steps is doubled until the extrapolated errors move no parameter by more than a small
share of its deviation, and a descent with these errors begins there (defect correction: H. J.
Stetter, Numerische Mathematik 29, 1978).
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..arm.arm import Arm
from ..identify.predictor import on_all_cores, with_steps_per_sample
from ..least_squares import Descended, Limits, as_finite, descend, normal_equations, pseudo_inverse

if TYPE_CHECKING:
    from ..identify.residuals import Residuals

MOST_DOUBLINGS = 2
"""Of the steps: friction has edges, with which they would go on for ever."""

MOST_MOVE = 0.0025
"""Squared move of the parameters by twice the steps, in their deviations, whatever the direction:
less than a twentieth of one."""

EDGE_RATIO = 0.3
"""Between the quarter and the half of what steps twice as long move a smooth motion and one with
edges."""

LAST_REDUCTION = 0.1
"""Reduction of the squared error, in mean squares of what is left, below which the last descent
ends: a parameter that is one deviation off costs one."""

MOST_DESCENT = 5.0
"""Deviations that a descent may move; what few steps miss is found anew where it ends further."""

MOST_ROUNDS = 3
"""Of corrections and descents; one or two are usual."""


class Anchor:
    """The error of few steps, taken from one model and added to all that are compared with it."""

    def __init__(self, at: Residuals, vector: np.ndarray, fine: Sequence[np.ndarray]) -> None:
        """`fine`: the weighted errors (M, k) per recording there that no steps miss."""
        self._at, self._vector = at, vector
        self._fine = tuple(fine)
        self._found: dict[int, tuple[np.ndarray, ...]] = {}
        self._lock = threading.Lock()

    @property
    def arm(self) -> Arm:
        """Of the model that it was taken from."""
        return self._at.experiments[0].model.arm

    def correction(self, steps: int) -> tuple[np.ndarray, ...]:
        """(M, k) per recording: to be added to weighted errors of so many steps per sample."""
        with self._lock:
            if steps not in self._found:
                coarse = errors_with(self._at, self._vector, steps)
                pairs = zip(self._fine, coarse, strict=True)
                self._found[steps] = tuple(as_finite(fine - block) for fine, block in pairs)
            return self._found[steps]


def with_steps(residuals: Residuals, steps: int) -> Residuals:
    """The same with so many steps per sample, nothing taken off."""
    return replace(
        residuals, predictor=with_steps_per_sample(residuals.predictor, steps), anchor=None
    )


def errors_with(residuals: Residuals, vector: np.ndarray, steps: int) -> list[np.ndarray]:
    """The weighted errors (M, k) per recording with so many steps per sample."""
    return with_steps(residuals, steps).blocks(vector)


def errors_with_each(
    residuals: Residuals, vector: np.ndarray, steps: Sequence[int]
) -> list[list[np.ndarray]]:
    """The errors with each number of steps, side by side: of a few recordings one simulation keeps
    one core busy."""
    return list(on_all_cores(lambda n: errors_with(residuals, vector, n), steps))


def extrapolated(coarse: Sequence[np.ndarray], fine: Sequence[np.ndarray]) -> list[np.ndarray]:
    """From errors (M, k) with some steps and twice as many: the method is of second order."""
    return [(4.0 * b - a) / 3.0 for a, b in zip(coarse, fine, strict=True)]


def corrected_minimum(
    residuals: Residuals,
    vector: np.ndarray,
    slopes: Sequence[np.ndarray],
    limits: Limits,
    stopped: Callable[[], bool] = lambda: False,
) -> tuple[Residuals, Descended]:
    """The minimum near a vector (P,) that many steps would give.

    Args:
        residuals: with a number of steps per sample to begin with.
        vector: a minimum with few steps.
        slopes: (M, k, P) per recording of the residuals near there.
        limits: bounds, and what is known beforehand, in units of the residuals.

    Returns:
        The residuals with what the steps miss taken off, and where the descent ended.
    """
    for left in reversed(range(MOST_ROUNDS)):
        residuals = with_corrected_steps(residuals, vector, slopes)
        cost = float(sum(np.sum(b * b) for b in residuals.blocks(vector)))
        found = descend(
            residuals.blocks, lambda x: residuals.sensitivities(x, central=False), vector, limits,  # noqa: B023
            stopped, good_enough=LAST_REDUCTION * cost / residuals.count**2, keep=True,
        )  # fmt: skip
        move, slopes = found.vector - vector, found.slopes
        moved = sum(float(np.sum((S @ move) ** 2)) for S in slopes)
        if not left or stopped() or not moved * residuals.count > MOST_DESCENT**2 * found.cost:
            break
        vector = found.vector
    return residuals, found


def with_corrected_steps(
    residuals: Residuals, vector: np.ndarray, slopes: Sequence[np.ndarray]
) -> Residuals:
    """The residuals with what their steps miss at a vector (P,) taken off; with so many steps that
    twice as many move no parameter by more than a share of its deviation."""
    steps = residuals.predictor.steps or 1
    runs = errors_with_each(residuals, vector, (steps, 2 * steps, 4 * steps))
    left = MOST_DOUBLINGS
    while True:
        coarse, better = (extrapolated(*pair) for pair in (runs[:2], runs[1:]))
        missed = _remaining_move(runs, coarse, better, slopes)
        if missed < MOST_MOVE or not left:
            break
        # Where edges, which halve it each time, will ask for two more, both are made side by side.
        more = min(left, 2 if missed > 4.0 * MOST_MOVE else 1)
        finer = [4 * steps * 2**k for k in range(1, more + 1)]
        runs = [*runs[more:], *errors_with_each(residuals, vector, finer)]
        steps, left = steps * 2**more, left - more
    fine = with_steps(residuals, steps)
    return replace(fine, anchor=Anchor(fine, vector, better))


def _remaining_move(
    runs: Sequence[list[np.ndarray]],
    coarse: Sequence[np.ndarray],
    better: Sequence[np.ndarray],
    slopes: Sequence[np.ndarray],
) -> float:
    """Squared move of the parameters, in their deviations, by what extrapolation still leaves.

    Where half the step leaves a quarter, as of a smooth motion, the extrapolated is of fourth order
    and its next change a sixteenth of the last one: a fifteenth is left. Edges leave all of it.

    Args:
        runs: errors (M, k) with some steps, twice and four times as many.
        coarse: the first two extrapolated; `better`: the last two.
    """
    first, second, last = (
        _moved([a - b for a, b in zip(*pair, strict=True)], slopes, better)
        for pair in ((runs[0], runs[1]), (runs[1], runs[2]), (coarse, better))
    )
    return last / 15.0**2 if second < EDGE_RATIO**2 * first else last


def _moved(
    change: Sequence[np.ndarray], slopes: Sequence[np.ndarray], errors: Sequence[np.ndarray]
) -> float:
    """Squared move of the minimum, in its deviations, by a change (M, k) of the errors: the part of
    it that lies along the slopes, in mean squares of the errors."""
    A, b = normal_equations(change, slopes)
    if not len(b):
        return 0.0
    count = sum(e.size for e in errors)
    cost = float(sum(np.sum(e * e) for e in errors))
    return float(b @ pseudo_inverse(A) @ b) * count / max(cost, 1e-300)
