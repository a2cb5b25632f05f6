"""Simulations with a fixed number of steps, LANES of them side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arm.arm import Structure
from ..arm.compiled import compile_wide_arm
from ..forces.compiled import compile_law
from ..forces.element import ElementArrays
from ..lanes.wide import LANES
from ..model import Model, Numbers
from ..processors import thread_pool
from ..progress import count_simulations
from ..simulate.drive_limits import drive_matrices
from ..simulate.linear import fill_lanes, interleave, law_lanes
from ..simulate.motion import Task, full_start, stretches
from ..simulate.rosenbrock import implicit_parts, integrate
from ..trajectory import Trajectory

WEAK_PIVOT = 1e-7
"""Share of a diagonal entry that must be left when the equations of a step are solved; below it
more than half of the digits are gone, and the simulation is repeated with twice the steps: the
shorter they are, the closer is their matrix to the positive definite mass matrix."""

DOUBLINGS = 3
"""After these a motion counts as diverged, and is not a number."""


@dataclass(frozen=True)
class Job:
    """One simulation: a model with its numbers, and what it is asked to do."""

    model: Model
    numbers: Numbers
    task: Task
    finish: Callable[[Trajectory], Trajectory] | None = None
    """What is done with the motion once it is simulated, where it is not all of it."""

    @property
    def parts(self) -> tuple[Model, Numbers, Task]:
        """Model, numbers and task."""
        return self.model, self.numbers, self.task

    def elements(self) -> ElementArrays:
        """The model's forces as arrays."""
        return self.numbers.packed(self.model.arm.coordinates)


def run(model: Model, numbers: Numbers, task: Task, substeps: int) -> Trajectory:
    """The motion with a fixed number of steps per sample."""
    return run_many([Job(model, numbers, task)], substeps)[0]


def run_many(jobs: Sequence[Job], substeps: int, workers: int = 1) -> list[Trajectory]:
    """The motion of each job with `substeps` steps per sample.

    Jobs that share a structure run side by side, the longest ones together, on up to `workers`
    threads; the compiled code holds no lock. A motion does not depend on what runs beside it.
    """
    (motions,) = passes(jobs, (substeps,), workers)
    return [finished(job, motion) for job, motion in zip(jobs, motions, strict=True)]


def passes(jobs: Sequence[Job], steps: Sequence[int], workers: int) -> tuple[list[Trajectory], ...]:
    """The motions of all jobs for each number of steps per sample, not yet finished."""
    packed = [job.elements() for job in jobs]
    chunks = _chunks(jobs, packed)
    chosen = [(substeps, chunk) for substeps in steps for chunk in chunks]
    done: dict[tuple[int, int], Trajectory] = {}

    def run_chunk(which: tuple[int, tuple[int, ...]]) -> None:
        substeps, chunk = which
        motions = _run_pass([jobs[i] for i in chunk], [packed[i] for i in chunk], substeps)
        done.update({(substeps, i): x for i, x in zip(chunk, motions, strict=True)})
        count_simulations(len(chunk))

    if workers > 1 and len(chosen) > 1:
        with thread_pool(workers) as pool:
            list(pool.map(run_chunk, chosen))
    else:
        for which in chosen:
            run_chunk(which)
    return tuple([done[substeps, i] for i in range(len(jobs))] for substeps in steps)


def _chunks(jobs: Sequence[Job], packed: Sequence[ElementArrays]) -> list[tuple[int, ...]]:
    """Indices of up to LANES jobs each that share a structure, the longest ones together."""
    groups: dict[tuple[object, ...], list[int]] = {}
    for i, job in enumerate(jobs):
        groups.setdefault(_structure(job, packed[i]), []).append(i)
    chunks = []
    for members in groups.values():
        ordered = sorted(members, key=lambda i: -len(jobs[i].task.time))
        chunks += [tuple(ordered[at : at + LANES]) for at in range(0, len(ordered), LANES)]
    return chunks


def finished(job: Job, motion: Trajectory) -> Trajectory:
    """What the job makes of its motion."""
    return motion if job.finish is None else job.finish(motion)


def _structure(job: Job, elements: ElementArrays) -> tuple[object, ...]:
    """What the lanes of one pass must share."""
    law = job.numbers.law
    return (
        Structure.of(job.model.arm),
        law.states,
        law.references,
        law.straight,
        len(job.numbers.inputs),
        elements.laws,
        tuple(elements.tips.tolist()),
        tuple(elements.loads.ravel().tolist()),
    )


def _run_pass(
    jobs: Sequence[Job], packed: Sequence[ElementArrays], substeps: int, doublings: int = DOUBLINGS
) -> list[Trajectory]:
    """The motions of up to LANES jobs of one structure."""
    states, torques, growth = simulate_lanes(jobs, packed, substeps)
    motions = [_trajectory(job, states, torques, lane) for lane, job in enumerate(jobs)]
    weak = [lane for lane in range(len(jobs)) if not growth[lane] * WEAK_PIVOT < 1.0]
    if weak and doublings:
        again = [jobs[i] for i in weak], [packed[i] for i in weak]
        for lane, motion in zip(weak, _run_pass(*again, 2 * substeps, doublings - 1), strict=True):
            motions[lane] = motion
    elif weak:
        for lane in weak:
            motions[lane] = replace(motions[lane], q=np.full_like(motions[lane].q, np.nan))
    return motions


def simulate_lanes(
    jobs: Sequence[Job], packed: Sequence[ElementArrays], substeps: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States [q, q', s, w] (N, 2 n + ns + nw, LANES) and the drives' torques (N, joints, LANES) of
    up to LANES jobs, and the largest growth in a step's matrix (LANES,).

    N is that of the longest; the first job fills the lanes that are left.
    """
    first, n = jobs[0], jobs[0].model.arm.coordinates
    laws = [job.numbers.law for job in jobs]
    drives, limits = law_lanes(laws), fill_lanes([law.limit for law in laws])
    dt = fill_lanes([np.array(job.task.sample_time) for job in jobs])
    places = fill_lanes([job.task.start[:n] for job in jobs])
    p = fill_lanes([job.numbers.p for job in jobs])
    K, D = first.model.compiled.linear_matrices(places, p)
    parts = tuple(map(_wide, implicit_parts(K, D, drives, dt / substeps)))
    inputs = len(first.numbers.inputs)
    law = tuple(map(_wide, (*drive_matrices(drives, inputs), limits)))
    arm, elements = compile_wide_arm(Structure.of(first.model.arm)), _elements(jobs, packed)
    samples = max(len(job.task.time) for job in jobs)
    signals = interleave([job.task.signals for job in jobs], samples)
    state = _side_by_side([full_start(job.task, job.numbers) for job in jobs])
    states = np.empty((samples, *state.shape))
    torques, growth = np.empty((samples, limits.shape[1], LANES)), np.ones((1, LANES))
    for rows in stretches(samples, substeps):
        integrate(
            arm.addresses, n, _wide(p), law, parts, elements,
            signals[rows].reshape(-1, LANES), inputs + laws[0].straight, state, _wide(dt), substeps,
            bool(np.isfinite(limits).any()), states[rows].reshape(-1, LANES),
            torques[rows].reshape(-1, LANES), growth,
        )  # fmt: skip
    return states, torques, growth[0]


def _wide(values: np.ndarray) -> np.ndarray:
    """(entries, LANES) from (LANES, ..)."""
    return np.ascontiguousarray(values.reshape(LANES, -1).T)


def _side_by_side(arrays: Sequence[np.ndarray]) -> np.ndarray:
    """(entries, LANES) from up to LANES arrays."""
    return _wide(fill_lanes(arrays))


def _trajectory(job: Job, states: np.ndarray, torques: np.ndarray, lane: int) -> Trajectory:
    """From the states and torques of all lanes."""
    N, n = len(job.task.time), job.model.arm.coordinates
    # As one column: numpy copies it faster than row by row.
    own, torque = (
        x[:N].reshape(-1, LANES)[:, lane].copy().reshape(N, -1) for x in (states, torques)
    )
    q, v = own[:, :n], own[:, n : 2 * n]
    return Trajectory(job.model.arm, job.model.compiled, job.numbers.p, job.task.time, q, v, torque)


def _elements(jobs: Sequence[Job], packed: Sequence[ElementArrays]) -> tuple[np.ndarray, ...]:
    """The arrays of core.simulate.elements.WIDE_ELEMENTS."""
    like = packed[0]
    addresses = np.array([compile_law(law).wide_address for law in like.laws], dtype=np.int64)
    return (
        addresses, like.ports, like.states, like.parameters,
        _side_by_side([arrays.directions for arrays in packed]),
        _side_by_side([arrays.values for arrays in packed]),
        like.tips, like.bristles, like.loads,
    )  # fmt: skip
