"""A start from the beginning of each recording, which then grows to its whole.

A vibration whose frequency is wrong by Df is out of step after 1 / (2 Df). Over a long recording
the cost therefore has many minima beside the true one, as near together as the recording is long,
and a descent from a stiffness that is a third off ends in one of them. Over the first few swings
there is one, and what it gives is near enough for twice the time, and so on. (A growing horizon, as
in A. Voss, J. Timmer, J. Kurths, Int. J. Bifurcation and Chaos 14, 2004, for multiple shooting.)
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from core.errors import InputError
from core.identify.predictor import Predictor
from core.identify.prepared import Prepared, prepare
from core.identify.refinement import OnStep, refine
from core.identify.residuals import Residuals
from core.recording.thinning import first_part

SHARES = (1 / 16, 1 / 8, 1 / 4, 1 / 2)
"""Of each recording. A stiffness that is wrong by 30 % puts a vibration out of step after three
swings; benches are recorded over some dozens."""

FEWEST = 8
"""Samples that count per unknown, below which a beginning says nothing of all of them."""

NEAR = 1e-2
"""Relative fall of the cost at which a descent ends: the next one takes more of the recording."""


def grown(residuals: Residuals, start: np.ndarray, on_step: OnStep) -> np.ndarray:
    """From where a descent over whole recordings is to begin; (P,) as `start`."""
    if all(e.model.arm.coordinates == e.model.arm.joints for e in residuals.experiments):
        return start  # what does not swing does not run out of step
    vector = start
    for share in SHARES:
        parts = beginnings(residuals.experiments, share)
        counted = sum(int(e.counted.sum()) for e in parts)
        if counted < FEWEST * len(vector):
            continue
        found = refine(_of(residuals, parts), vector, on_step, NEAR)
        if found.stopped_at_once or not np.isfinite(found.cost):
            break
        vector = found.vector
    return vector


SEARCHED = 30_000
"""Samples of all recordings together, on which a search over a population takes a few seconds; of
longer ones it takes the beginnings."""


def first_of(residuals: Residuals, most: int) -> Residuals:
    """The same over the beginnings of the recordings, with `most` samples of all together; as it is
    where there are no more."""
    samples = sum(len(e.recording.time) for e in residuals.experiments)
    parts = beginnings(residuals.experiments, most / samples) if samples > most else []
    return _of(residuals, parts) if parts else residuals


def _of(residuals: Residuals, experiments: Sequence[Prepared]) -> Residuals:
    """The same of other experiments."""
    known = residuals.predictor
    predictor = Predictor(experiments, known.unknowns, known.fixed, steps=known.steps)
    return Residuals(predictor, residuals.weights)


def beginnings(experiments: Sequence[Prepared], share: float) -> list[Prepared]:
    """The first `share` of each recording, ready for the same model; none where nothing of one
    counts."""
    found = []
    for e in experiments:
        part = first_part(e.recording, int(np.ceil(share * len(e.recording.time))))
        try:
            found.append(prepare(e.model, part, e.outputs, e.processing))
        except InputError:
            return []
    return found
