"""Simulations with a fixed number of steps, alone or LANES of them side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from ..arm.arm import Structure
from ..arm.compiled import compile_wide_arm
from ..drives.law import DriveLaw
from ..forces.compiled import compile_wide_law
from ..forces.element import ElementArrays
from ..lanes.wide import LANES
from ..model import Model, Numbers
from ..progress import current_progress, set_progress
from ..simulate.motion import Task, full_start, stretches
from ..simulate.rosenbrock import implicit_parts, integrate, integrate_lanes
from ..trajectory import Trajectory

WEAK_PIVOT = 1e-7
"""Share of a diagonal entry that must be left when the equations of a step are solved without
exchanging rows; below it more than half of the digits are gone, and the simulation is repeated with
exchanges."""


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


def law_arrays(law: DriveLaw) -> tuple[np.ndarray, ...]:
    """The law's arrays as compiled code takes them."""
    parts = (law.R, law.P, law.V, law.S, law.Fs, law.Fq, law.Fv, law.Fr, law.limit)
    return tuple(np.ascontiguousarray(part, dtype=float) for part in parts)


def flat(arrays: Sequence[np.ndarray]) -> tuple[np.ndarray, ...]:
    """The arrays' numbers, row by row."""
    return tuple(array.ravel() for array in arrays)


def run(model: Model, numbers: Numbers, task: Task, substeps: int) -> Trajectory:
    """One pass with a fixed number of steps per sample."""
    p, law = numbers.p, numbers.law
    n = model.arm.coordinates
    arrays = law_arrays(law)
    K, D = model.compiled.linear_matrices(task.start[:n], p)
    dt = task.sample_time
    parts = implicit_parts(K, D, arrays, dt / substeps)
    references = np.ascontiguousarray(task.references, dtype=float)
    elements, start = numbers.packed(n), full_start(task, numbers)
    states = np.empty((len(references), len(start)))
    torque = np.empty((len(references), len(law.R)))
    limited = bool(np.isfinite(law.limit).any())
    for rows in stretches(len(references), substeps):
        length = rows.stop - rows.start
        moved, pushed, _ = integrate(
            model.compiled.dynamics, model.compiled.tip, (n,), p, flat(arrays), flat(parts),
            elements.packed(), references[rows].ravel(), law.straight, start, np.array([dt]),
            length, substeps, limited,
        )  # fmt: skip
        states[rows], torque[rows] = moved.reshape(length, -1), pushed.reshape(length, -1)
        start = states[rows.stop - 1].copy()
    return Trajectory(
        model.arm, model.compiled, p, task.time, states[:, :n], states[:, n : 2 * n], torque
    )


def run_many(jobs: Sequence[Job], substeps: int, workers: int = 1) -> list[Trajectory]:
    """What `run` gives for each job with `substeps` steps per sample.

    Jobs that share a structure run side by side, the longest ones together, on up to `workers`
    threads; the compiled code holds no lock. A motion does not depend on what runs beside
    it; only whether anything does changes its rounding.
    """
    (motions,) = passes(jobs, (substeps,), workers)
    return [finished(job, motion) for job, motion in zip(jobs, motions, strict=True)]


def passes(jobs: Sequence[Job], steps: Sequence[int], workers: int) -> tuple[list[Trajectory], ...]:
    """The motions of all jobs for each number of steps per sample, not yet finished."""
    packed = [job.elements() for job in jobs]
    chunks = _side_by_side(jobs, packed)
    chosen = [(substeps, chunk) for substeps in steps for chunk in chunks]
    done: dict[tuple[int, int], Trajectory] = {}

    def run_chunk(which: tuple[int, tuple[int, ...]]) -> None:
        substeps, chunk = which
        if len(chunk) == 1:  # a pass of lanes would take two and a half times as long
            motions = [run(*jobs[chunk[0]].parts, substeps)]
        else:
            motions = _run_pass([jobs[i] for i in chunk], [packed[i] for i in chunk], substeps)
        done.update({(substeps, i): x for i, x in zip(chunk, motions, strict=True)})

    if workers > 1 and len(chosen) > 1:
        with ThreadPoolExecutor(
            workers, initializer=set_progress, initargs=(current_progress(),)
        ) as pool:
            list(pool.map(run_chunk, chosen))
    else:
        for which in chosen:
            run_chunk(which)
    return tuple([done[substeps, i] for i in range(len(jobs))] for substeps in steps)


def _side_by_side(jobs: Sequence[Job], packed: Sequence[ElementArrays]) -> list[tuple[int, ...]]:
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
        *(
            tuple(part.ravel().tolist())
            for part in (
                elements.addresses, elements.ports, elements.states, elements.parameters,
                elements.tips, elements.bristles, elements.loads,
            )
        ),
    )  # fmt: skip


def _interleaved(arrays: Sequence[np.ndarray]) -> np.ndarray:
    """(entries, LANES) of up to LANES arrays of one shape; the last fills what is left."""
    flat = [np.ravel(a) for a in arrays]
    out = np.empty((flat[0].size, LANES))
    for k in range(LANES):
        out[:, k] = flat[min(k, len(flat) - 1)]
    return out


def _padded(references: np.ndarray, length: int) -> np.ndarray:
    """(length, nr): the last row repeated."""
    missing = length - len(references)
    return np.pad(references, ((0, missing), (0, 0)), mode="edge") if missing else references


def _run_pass(
    jobs: Sequence[Job], packed: Sequence[ElementArrays], substeps: int
) -> list[Trajectory]:
    first, n = jobs[0], jobs[0].model.arm.coordinates
    laws = [law_arrays(job.numbers.law) for job in jobs]
    parts = []
    for job, law in zip(jobs, laws, strict=True):
        K, D = job.model.compiled.linear_matrices(job.task.start[:n], job.numbers.p)
        parts.append(implicit_parts(K, D, law, job.task.sample_time / substeps))
    sample_times = [job.task.sample_time for job in jobs]
    samples = max(len(job.task.time) for job in jobs)
    arm = compile_wide_arm(Structure.of(first.model.arm))
    p = _interleaved([job.numbers.p for job in jobs])
    law = tuple(_interleaved(columns) for columns in zip(*laws, strict=True))
    implicit = tuple(_interleaved(columns) for columns in zip(*parts, strict=True))
    elements, dt = _elements(jobs, packed), _interleaved([np.array([t]) for t in sample_times])
    references = [_padded(job.task.references, samples) for job in jobs]
    start = _interleaved([full_start(job.task, job.numbers) for job in jobs])
    limited = any(bool(np.any(np.isfinite(columns[-1]))) for columns in laws)
    results = [(np.empty((samples, 2 * n)), np.empty((samples, len(laws[0][-1])))) for _ in jobs]
    most = np.ones(LANES)
    for rows in stretches(samples, substeps):
        length = rows.stop - rows.start
        states, torques, growth = integrate_lanes(
            arm.dynamics, arm.tip, (n, *arm.solvers), p, law, implicit, elements,
            _interleaved([r[rows] for r in references]), first.numbers.law.straight, start, dt,
            length, substeps, limited,
        )  # fmt: skip
        states, torques = states.reshape(length, -1, LANES), torques.reshape(length, -1, LANES)
        start, most = states[-1].copy(), np.maximum(most, growth[0])
        for k, (moved, torque) in enumerate(results):
            moved[rows], torque[rows] = states[:, : 2 * n, k], torques[:, :, k]
    return [
        _trajectory(job, *result) if ratio < 1.0 / WEAK_PIVOT else run(*job.parts, substeps)
        for job, result, ratio in zip(jobs, results, most[: len(jobs)], strict=True)
    ]


def _trajectory(job: Job, moved: np.ndarray, torque: np.ndarray) -> Trajectory:
    """From [q, q'] (N' >= N, 2 n) and the drives' torques (N', joints) of a pass."""
    N, n = len(job.task.time), job.model.arm.coordinates
    q, v = np.ascontiguousarray(moved[:N, :n]), np.ascontiguousarray(moved[:N, n:])
    return Trajectory(
        job.model.arm, job.model.compiled, job.numbers.p, job.task.time, q, v, torque[:N]
    )


def _elements(jobs: Sequence[Job], packed: Sequence[ElementArrays]) -> tuple[np.ndarray, ...]:
    """The arrays of core.simulate.elements.WIDE_ELEMENTS."""
    like = packed[0]
    laws = sorted((e.law for e in jobs[0].numbers.elements), key=lambda law: law.bristle)
    addresses = np.array([compile_wide_law(law).address for law in laws], dtype=np.int64)
    return (
        addresses, like.ports, like.states, like.parameters,
        _interleaved([arrays.directions for arrays in packed]),
        _interleaved([arrays.values for arrays in packed]),
        like.tips, like.bristles, like.loads,
    )  # fmt: skip
