"""Non-linear simulation with a controlled and stated error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from core.drives.law import DriveLaw
from core.model import Model, Numbers
from core.simulate.motion import Task, full_start
from core.simulate.rosenbrock import implicit_parts, integrate
from core.trajectory import Trajectory

FEWEST_SUBSTEPS = 1
MOST_SUBSTEPS = 512
DEFAULT_TOLERANCE = 1e-6
"""m (rad): far below the noise of any camera or encoder that the recordings come from."""


@dataclass(frozen=True)
class Simulated:
    """A motion with the steps it took and an estimate of its largest error."""

    trajectory: Trajectory
    substeps: int
    error: float
    """Estimate of the largest error of tip (m) or joints (rad or m)."""


def law_arrays(law: DriveLaw) -> tuple[np.ndarray, ...]:
    """The law's arrays as compiled code takes them."""
    parts = (law.R, law.P, law.V, law.S, law.Fs, law.Fq, law.Fv, law.Fr, law.limit)
    return tuple(np.ascontiguousarray(part, dtype=float) for part in parts)


def run(model: Model, numbers: Numbers, task: Task, substeps: int) -> Trajectory:
    """One pass with a fixed number of steps per sample."""
    p, law = numbers.p, numbers.law
    n = model.arm.coordinates
    arrays = law_arrays(law)
    K, D = model.compiled.linear_matrices(task.start[:n], p)
    dt = task.sample_time
    parts = implicit_parts(K, D, arrays, dt / substeps)
    references = np.ascontiguousarray(task.references, dtype=float)
    elements = numbers.packed(n)
    states, torque = integrate(
        model.compiled.dynamics, model.compiled.tip, p, arrays, parts, elements.packed(),
        references, law.interpolate, full_start(task, numbers), dt, substeps,
    )  # fmt: skip
    return Trajectory(
        model.arm, model.compiled, p, task.time, states[:, :n], states[:, n : 2 * n], torque
    )


def extrapolated(coarse: Trajectory, fine: Trajectory, limit: np.ndarray) -> Trajectory:
    """Richardson: the method is of second order, so (4 fine - coarse)/3 is of third or better.

    `limit` (nj,): the drive's; where one pass meets it and the other does not, the mix would
    exceed it.
    """

    def mix(name: str) -> np.ndarray:
        return np.asarray((4.0 * getattr(fine, name) - getattr(coarse, name)) / 3.0)

    torque = np.clip(mix("torque"), -limit, limit)
    return Trajectory(fine.arm, fine.compiled, fine.p, fine.time, mix("q"), mix("v"), torque)


def difference(a: Trajectory, b: Trajectory) -> float:
    """Largest difference of tip places (m) and joint positions (rad or m)."""
    tips = np.abs(a.tip()[0] - b.tip()[0]).max()
    joints = np.abs(a.joint_positions - b.joint_positions).max()
    worst = max(float(tips), float(joints))
    return worst if np.isfinite(worst) else np.inf


def torque_difference(a: Trajectory, b: Trajectory) -> float:
    """Root mean square difference of the torques over the torque's own rms."""
    size = float(np.sqrt(np.mean(b.torque**2)))
    apart = float(np.sqrt(np.mean((a.torque - b.torque) ** 2)))
    return apart / size if size > 0.0 else 0.0


def simulate(
    model: Model,
    numbers: Numbers,
    task: Task,
    tolerance: float = DEFAULT_TOLERANCE,
    torque_tolerance: float = np.inf,
) -> Simulated:
    """Doubles the steps until that moves the extrapolated motion by less than the tolerance.

    The stated error is that last change. It is about the error of the extrapolation before, so
    it errs on the safe side. `torque_tolerance` is a share of the torque's rms: a stiff servo
    turns a tiny error of place into a large one of torque.
    """
    limit = numbers.law.limit
    substeps = 2 * FEWEST_SUBSTEPS
    fine = run(model, numbers, task, substeps)
    before = extrapolated(run(model, numbers, task, FEWEST_SUBSTEPS), fine, limit)
    while True:
        finer = run(model, numbers, task, 2 * substeps)
        after = extrapolated(fine, finer, limit)
        substeps *= 2
        error = difference(before, after)
        good = error <= tolerance and torque_difference(before, after) <= torque_tolerance
        if good or substeps >= MOST_SUBSTEPS:
            return Simulated(after, substeps, error)
        fine, before = finer, after


def simulate_fixed(model: Model, numbers: Numbers, task: Task, substeps: int) -> Trajectory:
    """Two passes and their extrapolation, with the number of steps found beforehand.

    The error then varies smoothly with the parameters, as finite differences need.
    """
    coarse = run(model, numbers, task, max(substeps // 2, 1))
    fine = run(model, numbers, task, max(substeps, 2))
    return extrapolated(coarse, fine, numbers.law.limit)
