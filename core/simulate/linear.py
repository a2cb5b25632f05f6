"""Response of the LPV descriptor model, up to LANES experiments at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from core.drives.law import DriveLaw
from core.forces.element import linear_matrices
from core.lanes.wide import LANES
from core.model import Model, Numbers
from core.simulate import lpv
from core.simulate.motion import Task, full_start
from core.trajectory import Trajectory

CACHE_LINE = 64
"""Bytes; a vector that straddles two lines costs twice."""


def aligned(shape: tuple[int, ...]) -> np.ndarray:
    """Zeros that start on a cache line."""
    size = int(np.prod(shape))
    memory = np.zeros(size + CACHE_LINE // 8)
    start = (-memory.ctypes.data % CACHE_LINE) // 8
    return memory[start : start + size].reshape(shape)


def law_lanes(laws: Sequence[DriveLaw]) -> tuple[np.ndarray, ...]:
    """The laws of up to LANES experiments, stacked; missing lanes repeat the first."""
    filled = list(laws) + [laws[0]] * (LANES - len(laws))
    names = ("R", "P", "V", "S", "Fs", "Fq", "Fv", "Fr")
    return tuple(
        np.ascontiguousarray([getattr(law, name) for law in filled], dtype=float) for name in names
    )


def with_forces(numbers: Numbers, task: Task) -> DriveLaw:
    """The drive's law with the slopes of extra forces, as feedback on all coordinates."""
    if not numbers.elements:
        return numbers.law
    law, n = numbers.law, task.schedule.shape[1]
    K, D = linear_matrices(numbers.elements, task.schedule[0])
    below = n - len(law.P)

    def padded(part: np.ndarray) -> np.ndarray:
        return np.vstack([part, np.zeros((below, part.shape[1]))])

    return replace(law, R=padded(law.R), P=padded(law.P) + K, V=padded(law.V) + D, S=padded(law.S))


def fill_lanes(arrays: Sequence[np.ndarray]) -> np.ndarray:
    """(LANES, ...) from up to LANES arrays; missing lanes repeat the first."""
    filled = list(arrays) + [arrays[0]] * (LANES - len(arrays))
    return np.ascontiguousarray(filled, dtype=float)


def interleave(columns: Sequence[np.ndarray], length: int) -> np.ndarray:
    """(length, k, LANES) from arrays (N_i, k), N_i <= length; short ones hold their last row."""
    out = aligned((length, columns[0].shape[1], LANES))
    for lane, column in enumerate(columns):
        out[: len(column), :, lane] = column
        out[len(column) :, :, lane] = column[-1]
    return out


def joint_schedule(tasks: Sequence[Task]) -> np.ndarray:
    """(T, LANES, n): only joint positions; T = 1 where no task's schedule varies."""
    length = max(len(task.schedule) for task in tasks)
    if length > 1:
        length = max(len(task.time) for task in tasks)
    rows = []
    for task in tasks:
        tail = np.repeat(task.schedule[-1:], length - len(task.schedule), axis=0)
        rows.append(np.vstack([task.schedule, tail]))
    return np.ascontiguousarray(np.stack([*rows, *[rows[0]] * (LANES - len(rows))], axis=1))


def respond(model: Model, numbers: Sequence[Numbers], tasks: Sequence[Task]) -> list[Trajectory]:
    """Motions of the linear model: exact discretisation at a working point; where a schedule
    varies, the model at the middle of each sample is held over it.
    """
    found: list[Trajectory] = []
    for first in range(0, len(tasks), LANES):
        some = slice(first, first + LANES)
        found += _respond_lanes(model, numbers[some], tasks[some])
    return found


def _respond_lanes(
    model: Model, numbers: Sequence[Numbers], tasks: Sequence[Task]
) -> list[Trajectory]:
    n, joints = model.arm.coordinates, model.arm.joints
    laws = [each.law for each in numbers]
    moving = [with_forces(each, task) for each, task in zip(numbers, tasks, strict=True)]
    states, nr = 2 * n + laws[0].states, laws[0].references
    rows, direct = [], []
    for law in laws:
        rows.append(np.vstack([np.eye(2 * n, states), -np.hstack([law.P, law.V, law.S])]))
        direct.append(np.vstack([np.zeros((2 * n, nr)), law.R]))
    length = max(len(task.time) for task in tasks)
    schedule = joint_schedule(tasks)
    out = aligned((length, 2 * n + joints, LANES))
    lpv.respond(
        model.compiled.dynamics, model.compiled.linear, fill_lanes([each.p for each in numbers]),
        law_lanes(moving), fill_lanes(rows), fill_lanes(direct), schedule, len(schedule) > 1,
        fill_lanes([np.array(task.sample_time) for task in tasks]),
        np.arange(states), not laws[0].interpolate,
        fill_lanes([full_start(t, each) for t, each in zip(tasks, numbers, strict=True)]),
        interleave([task.references for task in tasks], length + 1).ravel(),
        out.ravel(),
    )  # fmt: skip
    found = []
    for lane, (task, each) in enumerate(zip(tasks, numbers, strict=True)):
        y = out[: len(task.time), :, lane]
        q, v, u = y[:, :n], y[:, n : 2 * n], y[:, 2 * n :]
        found.append(Trajectory(model.arm, model.compiled, each.p, task.time, q, v, u, linear=True))
    return found
