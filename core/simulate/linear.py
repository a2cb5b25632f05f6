"""Response of the LPV descriptor model, up to LANES experiments at once.

State x = [q, q', s] with the drive's feedback closed, (11) of the paper for a velocity loop. The
discretisation is exact for the drive's kind of hold; along a recorded motion the model at the
middle of each sample is held over it. core.simulate.piecewise and core.simulate.along_motion are
faster and are tested against this.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..arm.signatures import addresses, cube, dynamics_of, kernel, linear_of, matrix, vector
from ..compiler import njit, types
from ..drives.law import DriveLaw, law_arrays
from ..forces.element import linear_matrices
from ..lanes.functions import INLINE
from ..lanes.rows import apply
from ..lanes.wide import LANES, get, put
from ..model import Model, Numbers
from ..simulate.discrete import (
    LAWS,
    aligned,
    discretised,
    place,
    start,
    work_arrays,
    write_outputs,
    write_step,
)
from ..simulate.motion import Task, full_start
from ..trajectory import Trajectory


@njit(**INLINE)
def advance(F, nx, ny, m, z, t, refs, nr, out):  # type: ignore[no-untyped-def]
    """One step of [x; y] from [r; x]; the outputs y of sample t go to out (N ny,).

    F (nx + ny, m + nx): the next state, then the outputs, from m references (nr held, 2 nr where
    they run straight between samples) and the state. z: two buffers [r; x; y] of m + nx + ny that
    take turns; sample t reads buffer t % 2. The references stand first because the state comes
    late: it waits for the step before.
    """
    size = m + nx + ny
    old = (t & 1) * size
    new = size - old
    for i in range(m):
        put(z, old + i, get(refs, t * nr + i))
    apply(F, 0, nx + ny, nx + ny, z, old, m + nx, z, new + m)
    for i in range(ny):
        put(out, t * ny + i, get(z, new + m + nx + i))


@kernel(
    types.void(
        addresses, matrix, LAWS, cube, cube, cube, types.boolean, vector,
        types.int64[::1], types.boolean, matrix, vector, vector,
    ),
)  # fmt: skip
def respond_lanes(  # type: ignore[no-untyped-def]
    arm, p, laws, C, D, schedule, varying, h, keep, hold, x0, refs, out
):
    """Response of LANES experiments, one exponential per sample where the model is `varying`.

    p (LANES, np); C (LANES, ny, N) and D (LANES, ny, nr) outputs over the full state of
    N = 2 n + ns; schedule (T, LANES, n) joint positions, only its first row where the model is
    not `varying`; h (LANES,) sample times in s; keep (nx,) the states that matter; x0
    (LANES, N); refs (T + 1, nr, LANES) and out (T, ny, LANES) flat.
    """
    dynamics, linear = dynamics_of(arm), linear_of(arm)
    n, nr, ns = schedule.shape[2], laws[0].shape[2], laws[3].shape[2]
    ny, nx = C.shape[1], keep.size
    m = nr if hold else 2 * nr
    na = nx + m
    r, y = refs.reshape((refs.size // LANES, LANES)), out.reshape((out.size // LANES, LANES))
    T = r.shape[0] // nr - 1
    q, space, columns = np.empty(n), work_arrays(n, ns, nr), 2 * n + ns + nr
    aug, work = aligned(na * na), aligned(5 * na * na).reshape((5, na * na, LANES))
    F, z, unit = aligned((nx + ny) * na), aligned(2 * (na + ny)), 0.0
    for t in range(T):
        if t == 0 or varying:
            following = min(t + 1, T - 1)
            for lane in range(LANES):
                for i in range(n):
                    q[i] = schedule[0, lane, i]
                    if varying:
                        q[i] = 0.5 * (schedule[t, lane, i] + schedule[following, lane, i])
                place(dynamics, linear, p[lane], q, laws, lane, lane, space)
            steps = h.reshape((1, LANES))
            E, unit = discretised(space, n, nr, columns, keep, steps, unit, aug, na, work)
            write_step(E, nx, m, nr, hold, F, nx + ny, 0)
        if t == 0:
            for lane in range(LANES):
                write_outputs(C[lane], D[lane], keep, n, m, unit, F[:, lane], nx + ny, nx)
                start(x0[lane], keep, n, unit, z[m:, lane])
        advance(F, nx, ny, m, z, t, r, nr, y)


def law_lanes(laws: Sequence[DriveLaw]) -> tuple[np.ndarray, ...]:
    """The laws of up to LANES experiments, in the order of LAWS."""
    return tuple(map(fill_lanes, zip(*[law_arrays(law)[:8] for law in laws], strict=True)))


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
    out = aligned.py_func(length * columns[0].shape[1]).reshape(length, -1, LANES)
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
    motions: list[Trajectory] = []
    for first in range(0, len(tasks), LANES):
        some = slice(first, first + LANES)
        motions += _respond_lanes(model, numbers[some], tasks[some])
    return motions


def _respond_lanes(
    model: Model, numbers: Sequence[Numbers], tasks: Sequence[Task]
) -> list[Trajectory]:
    n, joints = model.arm.coordinates, model.arm.joints
    laws = [x.law for x in numbers]
    moving = [with_forces(x, task) for x, task in zip(numbers, tasks, strict=True)]
    states, nr = 2 * n + laws[0].states, laws[0].references
    rows, direct = [], []
    for law in laws:
        rows.append(np.vstack([np.eye(2 * n, states), -np.hstack([law.P, law.V, law.S])]))
        direct.append(np.vstack([np.zeros((2 * n, nr)), law.R]))
    length = max(len(task.time) for task in tasks)
    schedule = joint_schedule(tasks)
    out = aligned.py_func(length * (2 * n + joints)).reshape(length, -1, LANES)
    respond_lanes(
        model.compiled.addresses, fill_lanes([x.p for x in numbers]),
        law_lanes(moving), fill_lanes(rows), fill_lanes(direct), schedule, len(schedule) > 1,
        fill_lanes([np.array(task.sample_time) for task in tasks]),
        np.arange(states), not laws[0].interpolate,
        fill_lanes([full_start(t, x) for t, x in zip(tasks, numbers, strict=True)]),
        interleave([task.references for task in tasks], length + 1).ravel(),
        out.ravel(),
    )  # fmt: skip
    motions = []
    for lane, (task, own) in enumerate(zip(tasks, numbers, strict=True)):
        y = out[: len(task.time), :, lane]
        q, v, u = y[:, :n], y[:, n : 2 * n], y[:, 2 * n :]
        motions.append(
            Trajectory(model.arm, model.compiled, own.p, task.time, q, v, u, linear=True)
        )
    return motions
