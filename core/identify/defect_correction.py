"""Correction of the step error: the minimum that many steps would give, at the price of few.

The step error hardly depends on the parameters. So it is found at one vector, by Richardson
extrapolation from two larger numbers of steps, and added to the errors with few steps at all
others. The larger numbers are doubled until the extrapolated errors move no parameter by more than
a small share of its standard deviation. Then a descent with few steps and this correction follows,
and another correction where it moved far (defect correction: H. J. Stetter, Numerische Mathematik
29, 1978). The last step goes along slopes without step error.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ..arm.arm import Arm
from ..identify.predictor import on_all_cores
from ..least_squares import (
    BoundsAndPrior,
    Descended,
    as_finite,
    cost_of,
    levenberg_marquardt,
    moving_columns,
    normal_equations,
    pseudo_inverse,
    zero_slopes,
)

if TYPE_CHECKING:
    from ..identify.residuals import Residuals

MOST_STEPS = 64
"""Steps per sample of the finest simulation: with friction doublings would never end."""

MOST_MOVE = 0.01
"""Squared move of the parameters by the step error, in standard deviations, in any direction: a
tenth of one adds half a per cent to it. Farther than MOST_DESCENT from the minimum a tenth of the
way will do."""

LAST_REDUCTION = 0.1
"""Reduction of the squared error, in mean squares of the residual, below which the last descent
ends; a parameter one standard deviation off costs one."""

MOST_DESCENT = 5.0
"""Standard deviations from where the step error was found to the end of a descent, above which it
is found again there: nearer, the errors are straight lines."""

MOST_ROUNDS = 6
"""Most corrections and descents; two are usual."""

STEP_SHARE = 0.1
"""Largest change of the errors by twice as many steps in a search, over the errors, rms."""

EXTRAPOLATED = 4.0
"""Times MOST_MOVE, by which extrapolated slopes may move the minimum: they leave at most half of
what they move it by."""


class Anchor:
    """The error of few steps, taken from one model and added to all models compared with it."""

    def __init__(self, at: Residuals, vector: np.ndarray, fine: Sequence[np.ndarray]) -> None:
        """`fine`: the weighted errors (M, k) per recording without step error."""
        self._at, self._vector = at, vector
        self._fine = tuple(fine)
        self._found: dict[int, tuple[np.ndarray, ...]] = {}
        self._diverged: set[int] = set()
        self._lock = threading.Lock()

    @property
    def arm(self) -> Arm:
        """The arm of that model."""
        return self._at.experiments[0].model.arm

    def weighted(self, weights: Sequence[np.ndarray]) -> Anchor:
        """The same with other weights (k,) per recording."""
        ratios = [b / a for a, b in zip(self._at.weights, weights, strict=True)]
        fine = [x * r for x, r in zip(self._fine, ratios, strict=True)]
        other = Anchor(replace(self._at, weights=weights), self._vector, fine)
        with self._lock:
            for steps, blocks in self._found.items():
                other._found[steps] = tuple(x * r for x, r in zip(blocks, ratios, strict=True))
            other._diverged |= self._diverged
        return other

    def has_diverged(self, steps: int) -> bool:
        """Whether the simulation of that model with so many steps per sample has diverged."""
        self.correction(steps)
        return steps in self._diverged

    def correction(self, steps: int) -> tuple[np.ndarray, ...]:
        """(M, k) per recording: added to weighted errors with so many steps per sample; zero where
        their simulation diverged."""
        with self._lock:
            if steps not in self._found:
                coarse = errors_with(self._at, self._vector, steps)
                if not np.isfinite(cost_of(coarse)):
                    self._diverged.add(steps)
                pairs = zip(self._fine, coarse, strict=True)
                self._found[steps] = tuple(as_finite(fine - block) for fine, block in pairs)
            return self._found[steps]


def with_steps(residuals: Residuals, steps: int) -> Residuals:
    """The residuals with so many steps per sample, without correction."""
    return replace(residuals, predictor=residuals.predictor.with_steps(steps), anchor=None)


def with_enough_steps(
    residuals: Residuals, vector: np.ndarray, negligible: float = 0.0
) -> Residuals:
    """The residuals with so many steps per sample, at least as many as they have, that twice as
    many hardly change what is left at a `vector` (P,), or change it by a `negligible` sum of
    squares.

    With fewer the errors of the steps are what a descent sees: with three modes per link and one
    step per millisecond the cost was ninety times that of the noise, and a fit took 44 iterations
    in place of two.
    """
    steps = residuals.predictor.steps
    errors = errors_with(residuals, vector, steps)
    while 2 * steps <= MOST_STEPS:
        finer = errors_with(residuals, vector, 2 * steps)
        change = cost_of([a - b for a, b in zip(errors, finer, strict=True)])
        if np.isfinite(change) and change <= max(STEP_SHARE**2 * cost_of(finer), negligible):
            break
        steps, errors = 2 * steps, finer
    return with_steps(residuals, steps)


def errors_with(residuals: Residuals, vector: np.ndarray, steps: int) -> list[np.ndarray]:
    """The weighted errors (M, k) per recording at a `vector` (P,) with so many steps per sample."""
    return with_steps(residuals, steps).blocks(vector)


def errors_with_each(
    residuals: Residuals, vector: np.ndarray, steps: Sequence[int]
) -> list[list[np.ndarray]]:
    """The errors at a `vector` (P,) with each number of steps, in parallel: one simulation of few
    recordings keeps one core busy."""
    return list(on_all_cores(lambda n: errors_with(residuals, vector, n), steps))


def extrapolated(coarse: Sequence[np.ndarray], fine: Sequence[np.ndarray]) -> list[np.ndarray]:
    """The errors without step error, from errors (M, k) with some steps and twice as many (second
    order)."""
    return [(4.0 * b - a) / 3.0 for a, b in zip(coarse, fine, strict=True)]


def corrected_minimum(
    residuals: Residuals, vector: np.ndarray, slopes: Sequence[np.ndarray], limits: BoundsAndPrior,
    stopped: Callable[[], bool] = lambda: False,
) -> tuple[Residuals, Descended]:  # fmt: skip
    """The residuals with what their steps per sample miss taken off, and the end of the descent
    near a vector (P,), a minimum with these steps, that many steps would give. `slopes`: (M, k, P)
    per recording near there; `limits` and what is known a priori in units of the residuals."""
    coarse = replace(residuals, anchor=None)
    fewest = of_slopes = max(coarse.predictor.steps // 2, 1)
    share, least = LAST_REDUCTION / residuals.count, np.inf
    for _ in range(MOST_ROUNDS):
        fewest, fine, is_near = _fine_errors(coarse, vector, slopes, fewest)
        is_first = least == np.inf
        if not (is_first or is_near or cost_of(fine) < (1.0 - share) * least):
            break  # far above the noise few steps may lead along a valley for ever
        corrected, least = replace(coarse, anchor=Anchor(coarse, vector, fine)), cost_of(fine)
        if is_near:
            of_slopes, descended = _along_fine_slopes(coarse, vector, fine, limits, of_slopes)
        else:
            descended = levenberg_marquardt(
                corrected.blocks, lambda x: coarse.slopes(x, central=False), vector, limits,
                stopped, good_enough=0.0, share=share,
            )  # fmt: skip
        is_short = not _length(descended.vector - vector, descended) > MOST_DESCENT**2
        if (is_near and is_short) or stopped() or not np.isfinite(descended.cost):
            break
        vector, slopes = descended.vector, descended.slopes
    return corrected, descended


def _fine_errors(
    residuals: Residuals, vector: np.ndarray, slopes: Sequence[np.ndarray], steps: int
) -> tuple[int, list[np.ndarray], bool]:
    """The first of three numbers of steps, at least `steps`, that suffice at a vector (P,), the
    errors (M, k) without step error, and whether the minimum is near: then more steps move no
    parameter by more than a share of its standard deviation."""
    runs = errors_with_each(residuals, vector, (steps, 2 * steps, 4 * steps))
    while True:
        better = extrapolated(*runs[-2:])
        away = _moved(better, slopes, better)
        is_near = away < MOST_DESCENT**2
        most = MOST_MOVE * (1.0 if is_near else away)
        if _remaining_move(runs, slopes) < most or 4 * steps >= MOST_STEPS:
            return steps, better, is_near
        steps *= 2
        runs = [*runs, errors_with(residuals, vector, 4 * steps)]


def _along_fine_slopes(
    residuals: Residuals,
    vector: np.ndarray,
    fine: Sequence[np.ndarray],
    limits: BoundsAndPrior,
    steps: int,
) -> tuple[int, Descended]:
    """The minimum of the errors (M, k) at a vector (P,) near it, along their slopes without step
    error, which are extrapolated from a number of steps, at least `steps`, and twice as many.

    With the slopes of few steps a descent ends where these, and not the true ones, are at right
    angles to the errors: with three modes per link two deviations off.
    """

    def slopes_with(steps: int) -> list[np.ndarray]:
        return with_steps(residuals, steps).slopes(vector, central=False)

    coarse, better = on_all_cores(slopes_with, (steps, 2 * steps))
    while True:
        plain, end = (
            minimum_along(S, fine, vector, limits)
            for S in (better, _extrapolated_slopes(coarse, better))
        )
        moved = _length(end.vector - plain.vector, end)
        if moved < EXTRAPOLATED * MOST_MOVE or 4 * steps > MOST_STEPS:
            return steps, end
        steps *= 2
        coarse, better = better, slopes_with(2 * steps)


def _extrapolated_slopes(
    coarse: Sequence[np.ndarray], fine: Sequence[np.ndarray]
) -> list[np.ndarray]:
    """The same of slopes (M, k, P), of which many columns may be zero."""
    slopes = [zero_slopes(S.shape[:-1], S.shape[-1]) for S in fine]
    for S, pair in zip(slopes, zip(coarse, fine, strict=True), strict=True):
        own, _ = moving_columns(pair[1])
        (S[..., own],) = extrapolated(*([x[..., own]] for x in pair))
    return slopes


def minimum_along(
    slopes: Sequence[np.ndarray], errors: Sequence[np.ndarray], vector: np.ndarray,
    limits: BoundsAndPrior,
) -> Descended:  # fmt: skip
    """The minimum where the errors (M, k) at a vector (P,) are straight lines along their
    `slopes` (M, k, P)."""
    return levenberg_marquardt(
        lambda x: [r + S @ (x - vector) for r, S in zip(errors, slopes, strict=True)],
        lambda _: slopes, vector, limits,
    )  # fmt: skip


def is_minimum(vector: np.ndarray, end: Descended) -> bool:
    """Whether the end of a descent is so near to a vector (P,) that a further step is needless."""
    return _length(end.vector - vector, end) < MOST_MOVE


def _remaining_move(runs: Sequence[list[np.ndarray]], slopes: Sequence[np.ndarray]) -> float:
    """Squared move of the parameters, in standard deviations, by the remaining step error of the
    last two of `runs`, extrapolated: errors (M, k) with some steps, twice as many, and so on.

    Twice as many steps leave a share of the error: a sixteenth of a smooth motion's (a quarter
    without extrapolation), half where there are edges, more where a vibration is not resolved; less
    only by chance. All further changes add up to share / (1 - share) of the last one.
    """
    better = [extrapolated(*pair) for pair in pairwise(runs)]
    # Of plain errors the share is larger: with three runs it stands for the other, as a bound.
    sequence, order = (better, 4) if len(better) > 2 else (runs, 2)
    least = 0.5**order
    first, second = (_change(*pair, slopes, better[-1]) for pair in pairwise(sequence[-3:]))
    share = max(np.sqrt(second / first), least) if first > 0.0 else least
    last = _change(better[-2], better[-1], slopes, better[-1])
    return last * (share / (1.0 - share)) ** 2 if share < 1.0 else np.inf


def _change(
    before: Sequence[np.ndarray],
    after: Sequence[np.ndarray],
    slopes: Sequence[np.ndarray],
    errors: Sequence[np.ndarray],
) -> float:
    """Squared move of the minimum from errors (M, k) before to those after."""
    return _moved([a - b for a, b in zip(before, after, strict=True)], slopes, errors)


def _moved(
    change: Sequence[np.ndarray], slopes: Sequence[np.ndarray], errors: Sequence[np.ndarray]
) -> float:
    """Squared move of the minimum, in standard deviations, by a change (M, k) of the errors: the
    part along the slopes, in mean squares of the errors."""
    A, b = normal_equations(change, slopes)
    if not len(b):
        return 0.0
    return float(b @ pseudo_inverse(A) @ b) * _unit(errors)


def _length(move: np.ndarray, end: Descended) -> float:
    """Squared length of a move (P,) in standard deviations, by where a descent ended."""
    return cost_of([S @ move for S in end.slopes]) * _unit(end.blocks)


def _unit(errors: Sequence[np.ndarray]) -> float:
    """One over the mean square of the errors (M, k)."""
    return sum(e.size for e in errors) / max(cost_of(errors), 1e-300)
