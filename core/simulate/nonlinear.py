"""Non-linear simulation with a controlled and stated error."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ..model import Model, Numbers
from ..progress import current_progress, set_progress
from ..simulate.batch import Job, finished, passes, run, run_many
from ..simulate.modal_truncation import bending, left_out
from ..simulate.motion import Task
from ..trajectory import Trajectory

FEWEST_SUBSTEPS = 1
MOST_SUBSTEPS = 512
DEFAULT_TOLERANCE = 1e-6
"""m (rad), rms: below the noise of any camera or encoder that the recordings come from."""

NOISE_SHARE = 0.1
"""Of a stated noise: an error of this size adds half a per cent to its standard deviation."""

SHARE = 0.5
"""Of what the modes leave out, or of the stated noise: an integration error of this size adds an
eighth to it."""

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
    """Richardson: the method is of second order, so (4 fine - coarse)/3 is of third or better.

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
    joints = np.sqrt(np.mean((a.joint_positions - b.joint_positions) ** 2, axis=0)).max()
    worst = max(_rms_distance(a, b), float(joints))
    return worst if np.isfinite(worst) else np.inf


def torque_difference(a: Trajectory, b: Trajectory) -> float:
    """Root mean square difference of the torques over the torque's own rms."""
    size = float(np.sqrt(np.mean(b.torque**2)))
    apart = float(np.sqrt(np.mean((a.torque - b.torque) ** 2)))
    return apart / size if size > 0.0 else 0.0


def simulate(
    model: Model, numbers: Numbers, task: Task, noise: float = 0.0, workers: int = 2
) -> Simulated:
    """As exact as matters: steps are refined until they add at most SHARE of the tip's noise (m),
    where one is stated, else of what the modes of the segments leave out.

    More steps would be spent on a model that misses the beam anyway. Arms that do not bend are
    simulated within DEFAULT_TOLERANCE.
    """
    if not (bending(model.arm) or noise):
        return simulate_within(model, numbers, task)
    gain, steps = _gain(np.nan, np.nan, numbers), model.steps(task.sample_time, FEWEST_SUBSTEPS)
    (coarse, missing), fine = _pair(model, numbers, task, steps, workers, missing=True)
    tolerance, apart = SHARE * (noise or missing), _rms_distance(coarse, fine)
    while apart / (gain - 1.0) > tolerance and 2 * steps < MOST_SUBSTEPS:
        steps *= 4
        (coarse, _), fine = _pair(model, numbers, task, steps, workers, missing=False)
        before, apart = apart, _rms_distance(coarse, fine)
        gain = _gain(np.sqrt(before), np.sqrt(apart), numbers)
    return Simulated(fine, 2 * steps, difference(coarse, fine) / (gain - 1.0))


def _gain(before: float, after: float, numbers: Numbers) -> float:
    """By how much twice the steps reduce the error, from two differences; what is safe where one is
    missing."""
    edges = bool(numbers.elements) or bool(np.isfinite(numbers.law.limit).any())
    least = GAIN_AT_EDGES if edges else LEAST_GAIN
    known = np.isfinite(before) and after > 0.0
    return float(np.clip(before / after, least, MOST_GAIN)) if known else least


def _pair(
    model: Model, numbers: Numbers, task: Task, steps: int, workers: int, missing: bool
) -> tuple[tuple[Trajectory, float], Trajectory]:
    """The motion with `steps` per sample, beside it what the modes leave out (rms, m), and the
    motion with twice the steps; compiled code holds no lock, so that both run at once."""

    def coarser() -> tuple[Trajectory, float]:
        motion = run(model, numbers, task, steps)
        if not missing:
            return motion, np.nan
        joints = motion.joint_positions
        if not np.isfinite(joints).all():
            joints = np.tile(task.start[: model.arm.joints], (len(task.time), 1))
        return motion, _rms(left_out(model, numbers, task, joints))

    if workers < 2:
        return coarser(), run(model, numbers, task, 2 * steps)
    with ThreadPoolExecutor(1, initializer=set_progress, initargs=(current_progress(),)) as pool:
        beside = pool.submit(coarser)
        fine = run(model, numbers, task, 2 * steps)
        return beside.result(), fine


def _rms(distance: np.ndarray) -> float:
    """Root mean square length of (N, 2)."""
    return float(np.sqrt(np.mean(np.sum(distance * distance, axis=1))))


def _rms_distance(a: Trajectory, b: Trajectory) -> float:
    """Of the tips, m; infinite where one motion diverged."""
    distance = _rms(a.tip()[0] - b.tip()[0])
    return distance if np.isfinite(distance) else np.inf


def simulate_within(
    model: Model,
    numbers: Numbers,
    task: Task,
    tolerance: float = DEFAULT_TOLERANCE,
    torque_tolerance: float = np.inf,
    workers: int = 1,
) -> Simulated:
    """`simulate_many` of one."""
    return simulate_many([Job(model, numbers, task)], tolerance, torque_tolerance, workers)[0]


def simulate_many(
    jobs: Sequence[Job], tolerance: float, torque_tolerance: float = np.inf, workers: int = 1
) -> list[Simulated]:
    """Doubles the steps of each job until its extrapolated motion is within the tolerance, rms.

    The stated error follows from the last change and what twice the steps gained.
    `torque_tolerance` is a share of the torque's rms: a stiff servo turns a tiny error of place
    into a large one of torque.
    """
    limits = [job.numbers.law.limit for job in jobs]
    steps = 4 * FEWEST_SUBSTEPS
    first, second, fine = _finished_passes(jobs, (steps // 4, steps // 2, steps), workers)
    before = list(map(extrapolated, first, second, limits))
    after = list(map(extrapolated, second, fine, limits))
    simulated: dict[int, Simulated] = {}
    changes = [np.nan] * len(jobs)
    while True:
        for i in set(range(len(jobs))) - set(simulated):
            last, changes[i] = changes[i], difference(before[i], after[i])
            error = changes[i] / (_gain(last, changes[i], jobs[i].numbers) - 1.0)
            good = error <= tolerance
            good = good and torque_difference(before[i], after[i]) <= torque_tolerance
            if good or steps >= MOST_SUBSTEPS:
                simulated[i] = Simulated(after[i], steps, error)
        left = [i for i in range(len(jobs)) if i not in simulated]
        if not left:
            return [simulated[i] for i in range(len(jobs))]
        steps *= 2
        for i, finer in zip(left, run_many([jobs[i] for i in left], steps, workers), strict=True):
            before[i], after[i] = after[i], extrapolated(fine[i], finer, limits[i])
            fine[i] = finer


def _finished_passes(
    jobs: Sequence[Job], steps: Sequence[int], workers: int
) -> list[list[Trajectory]]:
    """The motions of all jobs for each number of steps per sample, side by side."""
    return [
        [finished(job, motion) for job, motion in zip(jobs, motions, strict=True)]
        for motions in passes(jobs, steps, workers)
    ]


def run_many_extrapolated(jobs: Sequence[Job], substeps: int, workers: int = 1) -> list[Trajectory]:
    """Two passes of each job and their extrapolation, with a fixed number of steps, so that the
    error varies smoothly with the parameters."""
    fine, coarse = passes(jobs, (max(substeps, 2), max(substeps // 2, 1)), workers)
    return [
        finished(job, extrapolated(a, b, job.numbers.law.limit))
        for a, b, job in zip(coarse, fine, jobs, strict=True)
    ]
