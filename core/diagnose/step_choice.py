"""How many integration steps per sample the models of a search take."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..diagnose.fit_problem import FitProblem, parametrised
from ..effects.effect import Effect
from ..identify.defect_correction import MOST_STEPS, with_enough_steps

SEARCH_ERROR = 0.6
"""In noise floors, rms: a smaller step error in the search is negligible. `Anchor` corrects it and
leaves about a tenth (measured with friction, elastic joints, lag and damping)."""

LEAST_COSINE = 0.9
"""Least cosine between an unknown's sensitivity with some steps and with twice as many. A step
along a direction this far off still takes eight tenths (its square) of the possible reduction. With
a link at half the sampling rate, one step per sample and a cosine of -0.2, a stiffness stopped 8
per cent off and a soft base was named."""


def with_enough_substeps(
    data: FitProblem, effects: Sequence[Effect], values: Mapping[str, float], factor: int = 1
) -> FitProblem:
    """The data with `factor` times the steps that a model needs, half of them for models whose step
    error the anchor corrects, and with as many as directions need. (Errors that are compared take
    twice as many: core.diagnose.refit.COMPARED_SUBSTEPS.)"""
    steps = factor * enough_substeps(data, effects, values)
    few = substeps_for_directions(data, effects, values, max(steps // 2, 1))
    return replace(data, substeps=max(steps, few), anchored_substeps=few)


def enough_substeps(
    data: FitProblem, effects: Sequence[Effect], values: Mapping[str, float]
) -> int:
    """Steps per sample, such that twice as many change the outputs by less than SEARCH_ERROR, or by
    a small share of what the model leaves."""
    h = parametrised(replace(data, substeps=1, anchor=None), effects, values)
    enough = with_enough_steps(h.residuals, h.vector, SEARCH_ERROR**2 * data.count)
    return enough.predictor.steps // h.substeps


def substeps_for_directions(
    data: FitProblem, effects: Sequence[Effect], values: Mapping[str, float], least: int
) -> int:
    """Steps per sample, from `least` on, for reliable descent directions: twice as many change the
    shared sensitivities little."""
    half = max(least // 2, 1)  # of the steps are what directions are taken with
    slopes = _slopes(data, effects, values, half)
    while 2 * half < MOST_STEPS:
        finer = _slopes(data, effects, values, 2 * half)
        if _least_cosine(slopes, finer) > LEAST_COSINE:
            break
        half, slopes = 2 * half, finer
    return max(least, 2 * half) if half > 1 else least


def _slopes(
    data: FitProblem, effects: Sequence[Effect], values: Mapping[str, float], steps: int
) -> list[np.ndarray]:
    """Sensitivity (N,) to each shared unknown, with so many steps per sample."""
    h = parametrised(replace(data, substeps=steps, anchor=None), effects, values)
    shared = [k for k, u in enumerate(h.unknowns.items) if u.recording is None]
    if not shared:
        return []
    sensitivities = h.residuals.sensitivities(h.vector, central=False, only=shared)
    return [np.concatenate([S[:, :, k].ravel() for S in sensitivities]) for k in shared]


def _least_cosine(first: Sequence[np.ndarray], second: Sequence[np.ndarray]) -> float:
    """Least cosine of pairs of non-zero vectors (N,); one if there are none."""
    sizes = [np.linalg.norm(a) * np.linalg.norm(b) for a, b in zip(first, second, strict=True)]
    cosines = [a @ b / s for a, b, s in zip(first, second, sizes, strict=True) if s > 0.0]
    return float(min(cosines, default=1.0))
