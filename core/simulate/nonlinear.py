"""Non-linear simulation with a controlled and stated error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..model import Model, Numbers
from ..processors import workers
from ..simulate.batch import Job, finished, passes, run
from ..simulate.motion import Task
from ..trajectory import Trajectory

MOST_SUBSTEPS = 512
DEFAULT_TOLERANCE = 1e-6
"""m (rad), rms: below the noise of any camera or encoder that the recordings come from."""

NOISE_SHARE = 0.1
"""Of a stated noise: an error of this size adds half a per cent to its standard deviation."""

LEAST_GAIN, MOST_GAIN = 4.0, 6.0
"""By how much twice the steps reduce the error: the method is of second order, extrapolated of
third; what a motion that few steps resolve badly gains beyond, its next doubling does not."""

GAIN_AT_EDGES = 2.0
"""The same where a force or a limit has edges, of which a step sees nothing inside."""


@dataclass(frozen=True)
class Simulated:
    """A motion with the steps it took and an estimate of its largest error."""

    trajectory: Trajectory
    substeps: int
    error: float
    """Estimate of the rms error of tip (m) or joints (rad or m) that the steps make."""


def extrapolated(coarse: Trajectory, fine: Trajectory, limit: np.ndarray) -> Trajectory:
    """Richardson (1911): the method is of second order, so (4 fine - coarse)/3 is of third or
    better.

    `limit` (nj,): the drive's; where one pass meets it and the other does not, the mix would
    exceed it.
    """

    def mix(name: str) -> np.ndarray:
        values = getattr(fine, name)  # so written, what both have in common stays as it is
        return np.asarray(values + (values - getattr(coarse, name)) / 3.0)

    torque = np.clip(mix("torque"), -limit, limit)
    return Trajectory(fine.arm, fine.compiled, fine.p, fine.time, mix("q"), mix("v"), torque)


def difference(a: Trajectory, b: Trajectory) -> float:
    """The larger rms difference, of tip places (m) or of a joint's positions (rad or m)."""
    tips = np.sqrt(np.mean(np.sum((a.tip()[0] - b.tip()[0]) ** 2, axis=1)))
    joints = np.sqrt(np.mean((a.joint_positions - b.joint_positions) ** 2, axis=0)).max()
    worst = max(float(tips), float(joints))
    return worst if np.isfinite(worst) else np.inf


def _gain(before: float, after: float, numbers: Numbers) -> float:
    """By how much twice the steps reduce the error, from two differences; what is safe where one is
    missing."""
    edges = bool(numbers.elements) or bool(np.isfinite(numbers.law.limit).any())
    least = GAIN_AT_EDGES if edges else LEAST_GAIN
    known = np.isfinite(before) and after > 0.0
    return float(np.clip(before / after, least, MOST_GAIN)) if known else least


def simulate_within(
    model: Model, numbers: Numbers, task: Task, tolerance: float = DEFAULT_TOLERANCE
) -> Simulated:
    """The motion within a `tolerance` in m (rad), rms, in steps that are doubled until then.

    It is extrapolated; its error follows from the last change and what twice the steps gained.
    """
    job, limit, steps = Job(model, numbers, task), numbers.law.limit, 4
    first, second, fine = (finished(job, x) for (x,) in passes([job], (1, 2, steps), workers()))
    before, after = extrapolated(first, second, limit), extrapolated(second, fine, limit)
    change = np.nan
    while True:
        last, change = change, difference(before, after)
        error = change / (_gain(last, change, numbers) - 1.0)
        if error <= tolerance or steps >= MOST_SUBSTEPS:
            return Simulated(after, steps, error)
        steps *= 2
        finer = run(model, numbers, task, steps)
        before, after, fine = after, extrapolated(fine, finer, limit), finer
