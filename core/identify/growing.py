"""A start from the beginning of each recording, which then grows to its whole.

A vibration whose frequency is wrong by Df is out of step after 1 / (2 Df). Over a long recording
the cost therefore has many minima beside the true one, as near together as the recording is long,
and a descent from a stiffness that is a third off ends in one of them. Over the first few swings
there is one, and what it gives is near enough for twice the time, and so on. (A growing horizon, as
in A. Voss, J. Timmer, J. Kurths, Int. J. Bifurcation and Chaos 14, 2004, for multiple shooting.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from core.drives.servo import FollowingServo
from core.errors import InputError
from core.identify.guide import is_guided
from core.identify.led_points import fastest_swing
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
    vector, guided = start, is_guided(residuals.experiments[0].model)
    for share in (*SHARES, 1.0) if guided else SHARES:
        parts = beginnings(residuals.experiments, share)
        counted = sum(int(e.counted.sum()) for e in parts)
        if counted < FEWEST * len(vector):
            continue
        part = _of(residuals, parts)
        if guided:
            vector, guided = _in_step(residuals, part, vector, on_step), False
        found = refine(part, vector, on_step, NEAR)
        if found.stopped_at_once or not np.isfinite(found.cost):
            break
        vector = found.vector
    return vector


def _of(residuals: Residuals, experiments: Sequence[Prepared]) -> Residuals:
    """The same of other experiments."""
    known = residuals.predictor
    predictor = Predictor(experiments, known.unknowns, known.fixed, steps=known.steps)
    return Residuals(predictor, residuals.weights)


RANGE = 4.0
"""Factor by which a stiffness may be off either way: nominal ones were by as much on benches."""

IN_STEP = 1.0
"""rad by which a vibration may be out of step at the end of a beginning for a descent to go on."""

MOST_TRIED = 256
"""Values of one parameter: recordings begin with some dozens of swings."""

ROUNDS = 3
"""Through all parameters at most, until none of the others moves any more."""


def _in_step(
    residuals: Residuals, part: Residuals, start: np.ndarray, on_step: OnStep
) -> np.ndarray:
    """Where each vibration of a guided arm stays in step over the beginnings `part`: from a fit
    without a guide one parameter after the other is tried over its whole range, since beyond a few
    swings the cost has a minimum for every swing more or less."""
    vector = refine(_of(residuals, _unguided(part.experiments)), start, on_step, NEAR).vector
    items = residuals.unknowns.items
    free = [i for i, u in enumerate(items) if u.searched and u.parameter.positive and start[i] > 0]
    e = part.experiments[0]
    last = max(len(e.task.time) for e in part.experiments)
    swung = last * fastest_swing(e.model, e.model.numbers(), e.recording.sample_time)
    count = int(np.clip(np.log(RANGE) * swung / IN_STEP, 2, MOST_TRIED))
    factors = RANGE ** np.linspace(-1.0, 1.0, count)  # a frequency goes with a stiffness' root
    p = residuals.unknowns.parameters
    unmoved = 0
    for i in free * ROUNDS:
        tried = np.tile(vector, (count + 1, 1))
        tried[1:, i] *= factors
        tried = np.clip(tried, p.lower(), p.upper())
        costs = _tried(part, tried, on_step)
        best = int(np.argmin(costs))
        unmoved, vector = unmoved + 1 if best == 0 else 1, tried[best]
        if unmoved >= len(free) or len(costs) < len(tried):
            break
    return vector


AT_ONCE = 32
"""Values that are tried before anybody is asked whether to go on: half a second."""


def _tried(part: Residuals, vectors: np.ndarray, on_step: OnStep) -> np.ndarray:
    """Costs (S,) of vectors (S, P), infinite where there is none; fewer where it is stopped."""
    found: list[float] = []
    for at in range(0, len(vectors), AT_ONCE):
        costs = part.costs(vectors[at : at + AT_ONCE])
        found += np.where(np.isfinite(costs), costs, np.inf).tolist()
        if on_step(min(found)):
            break
    return np.array(found)


def _unguided(experiments: Sequence[Prepared]) -> list[Prepared]:
    """The same, led along splines."""
    found = []
    for e in experiments:
        servo = e.model.steering
        assert isinstance(servo, FollowingServo)
        found.append(replace(e, model=e.model.steered_by(replace(servo, guided=False))))
    return found


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
