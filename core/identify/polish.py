"""The last step of a fit whose simulations make errors: to where finer steps would have led.

A search takes few steps per sample. They miss the outputs, and they miss their slopes: with the
modes of a beam under-resolved the slopes of one case were off by 8 %, and against noise that moved
an estimate by a quarter of its deviation. So the last step has the outputs' error taken off at the
vector itself, and slopes from more and more steps until the answer stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from core.identify.refinement import Refined
from core.identify.residuals import Residuals
from core.least_squares import SEEN, limits_of
from core.simulate.nonlinear import LEAST_GAIN

LEFT = 0.1
"""Deviations that twice the steps may still move an estimate by."""

NEAR = 5.0
"""Deviations of a last step at most; after a longer one another follows."""

MOST_ROUNDS = 3
"""Steps; a minimum that is further away is sought by a descent."""

LEFT_BY_TWICE = 1.0 / LEAST_GAIN
"""Share of a step's error that is left with twice the steps, at most."""

THIRD_ORDER = 7.0
"""2^3 - 1: of two extrapolated passes of a smooth motion the finer one has an eighth of the
other's error."""

Slopes = tuple[np.ndarray, ...]


def polished(residuals: Residuals, refined: Refined) -> Refined | None:
    """The minimum with the steps' error taken off; None where some steps do not lead there.

    The predictor goes on with the steps that were needed in the end.
    """
    vector, p = refined.vector, residuals.unknowns.parameters
    known: dict[int, Slopes] = {}
    steps = residuals.predictor.steps or 1
    for _ in range(MOST_ROUNDS):
        move, slopes, near = _move(residuals, vector, steps, known)
        vector = np.clip(vector + move, p.lower(), p.upper())
        if near:
            r, J = residuals(vector), residuals.vector(slopes) * residuals.scales
            size = np.linalg.norm(J) * np.linalg.norm(r)
            gradient = float(np.linalg.norm(J.T @ r) / size) if size > 0.0 else 0.0
            cost = float(r @ r)
            return replace(refined, vector=vector, cost=cost, gradient=gradient, slopes=slopes)
    return None


def _move(
    residuals: Residuals, vector: np.ndarray, steps: int, known: dict[int, Slopes]
) -> tuple[np.ndarray, Slopes, bool]:
    """The step (P,), the slopes (M, k, P) it was found with, and whether it ends at the minimum;
    from `steps` per sample or more. `known` holds slopes by steps per sample; those of a place
    near by serve as well."""
    predictor = residuals.predictor
    fine = predictor.exactly(vector)
    most = max(predictor.substeps.values(), default=1)
    before, coarser = None, None
    while True:
        coarse = predictor.take_off(fine, vector, steps)
        if coarser is not None and _smooth(residuals):
            fine = _finer(residuals, fine, coarse, coarser, steps)
            predictor.take_off(fine, vector, steps)
        if steps not in known:
            known[steps] = tuple(residuals.sensitivities(vector, central=False))
        move, deviations = _step(residuals, vector, known[steps])
        near = bool(np.all(np.abs(move) <= NEAR * deviations))
        apart = np.inf if before is None else np.max(np.abs(move - before) / deviations, initial=0)
        if not near or apart * LEFT_BY_TWICE <= LEFT or 2 * steps > most:
            return move, known[steps], near
        before, coarser, steps = move, coarse, 2 * steps


def _smooth(residuals: Residuals) -> bool:
    """Whether nothing that is simulated has edges, so that orders of convergence hold."""
    numbers = [e.model.numbers() for e in residuals.experiments]
    return not any(n.elements or np.any(np.isfinite(n.law.limit)) for n in numbers)


def _finer(
    residuals: Residuals,
    fine: Sequence[np.ndarray],
    coarse: Sequence[np.ndarray],
    coarser: Sequence[np.ndarray],
    steps: int,
) -> list[np.ndarray]:
    """The outputs extrapolated once more, where they are from `steps` and twice as many; `coarse`
    are those of `steps`, `coarser` of half as many."""
    found, substeps = [], residuals.predictor.substeps
    for e, y, a, b in zip(residuals.experiments, fine, coarse, coarser, strict=True):
        known = substeps.get(e.recording.name) == 2 * steps
        found.append(y + (y - (4.0 * a - b) / 3.0) / THIRD_ORDER if known else y)
    return found


def _step(
    residuals: Residuals, vector: np.ndarray, slopes: Sequence[np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """The Gauss-Newton step (P,) of what is free to move, and the deviations (P,) of the
    estimates under white noise; infinite where nothing tells them."""
    scales, limits = residuals.scales, limits_of(residuals.unknowns.parameters)
    r = residuals(vector)
    level = float(np.sqrt(np.mean(r**2)))
    weights = level / np.asarray(limits.deviations)  # of the priors, as rows of their own
    J = np.vstack([residuals.vector(slopes), np.diag(weights)]) * scales
    whole = np.concatenate([r, weights * (vector - limits.believed)])
    free = np.ones(len(vector), dtype=bool)
    move = np.zeros(len(vector))
    while free.any():
        move[:] = 0.0
        move[free] = -np.linalg.lstsq(J[:, free], whole, rcond=SEEN**0.5)[0]
        at = vector + move * scales
        beyond = free & ((at < limits.lower) | (at > limits.upper))
        if not beyond.any():
            break
        free &= ~beyond
    found = np.full(len(vector), np.inf)
    variances = np.diag(np.linalg.pinv(J[:, free].T @ J[:, free], SEEN))
    found[free] = level * np.sqrt(np.maximum(variances, 0.0))
    found[free & (found <= 0.0)] = np.inf
    return move * scales, found * scales
