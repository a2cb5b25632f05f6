"""Compiled response of the LPV descriptor model, E(kappa) x' = A(kappa) x + B r.

State x = [q, q', s] with the drive's feedback closed, (11) of the paper for a velocity loop.
The discretisation is exact for the drive's kind of hold; along a recorded motion the model at the
middle of each sample is held over it. core.simulate.pieces and core.simulate.followed are faster
and are tested against this.
"""

from __future__ import annotations

import numpy as np
from numba import njit, types

from core.arm.signatures import DYNAMICS, LINEAR, OPTIONS, cube, kernel, matrix, vector
from core.simulate.closed import augment, balance, place, solve, work_arrays
from core.simulate.lanes import advance_and_store, aligned, exponential
from core.simulate.vector import LANES


@njit(**OPTIONS)
def collect(E, F, C, D, keep, n, ny, nr, held, lane, scale):  # type: ignore[no-untyped-def]
    """One lane of F (nx + ny, nx + m, LANES) from the exponential E and the outputs C, D."""
    nx = keep.size
    m = nr if held else 2 * nr
    na, rows = nx + m, nx + ny
    for i in range(nx):
        for j in range(nx):
            F[((m + j) * rows + i) * LANES + lane] = E[(j * na + i) * LANES + lane]
        for j in range(nr):
            first = E[((nx + j) * na + i) * LANES + lane]
            if held:
                F[(j * rows + i) * LANES + lane] = first
            else:
                later = E[((nx + nr + j) * na + i) * LANES + lane]
                F[(j * rows + i) * LANES + lane] = first - later
                F[((nr + j) * rows + i) * LANES + lane] = later
    for i in range(ny):
        for j in range(nx):
            sj = scale if keep[j] < n else 1.0
            F[((m + j) * rows + nx + i) * LANES + lane] = C[lane, i, keep[j]] / sj
        for j in range(m):
            F[(j * rows + nx + i) * LANES + lane] = D[lane, i, j] if j < nr else 0.0


LAWS = types.Tuple((cube,) * 8)
"""R, P, V, S, Fs, Fq, Fv, Fr of core.drives.law.DriveLaw; the lanes come first."""


@kernel(
    types.void(
        DYNAMICS, LINEAR, matrix, LAWS, cube, cube, cube, types.boolean, vector,
        types.int64[::1], types.boolean, matrix, vector, vector,
    ),
)  # fmt: skip
def respond(  # type: ignore[no-untyped-def]
    dynamics, linear, p, laws, C, D, schedule, varying, h, keep, held, x0, refs, out
):
    """Response of LANES experiments, one exponential per sample where the model is `varying`.

    p (LANES, np); C (LANES, ny, N) and D (LANES, ny, nr) outputs over the full state of
    N = 2 n + ns; schedule (T, LANES, n) joint positions, only its first row where the model is
    not `varying`; h (LANES,) sample times in s; keep (nx,) the states that matter; x0
    (LANES, N); refs (T + 1, nr, LANES) and out (T, ny, LANES) flat.
    """
    n, nr, ns = schedule.shape[2], laws[0].shape[2], laws[3].shape[2]
    ny, nx = C.shape[1], keep.size
    m = nr if held else 2 * nr
    na = nx + m
    T = refs.size // (nr * LANES) - 1
    q, space, columns = np.empty(n), work_arrays(n, ns, nr), 2 * n + ns + nr
    aug, work = aligned(na * na * LANES), aligned(5 * na * na * LANES).reshape(5, -1)
    F = aligned((nx + ny) * na * LANES)
    z = aligned(2 * (na + ny) * LANES)
    scale = 1.0
    for t in range(T):
        if t == 0 or varying:
            following = min(t + 1, T - 1)
            for lane in range(LANES):
                for i in range(n):
                    q[i] = schedule[0, lane, i]
                    if varying:
                        q[i] = 0.5 * (schedule[t, lane, i] + schedule[following, lane, i])
                place(dynamics, linear, p[lane], q, laws, lane, lane, space)
            solve(space[5], n, space[6], columns)
            if t == 0:
                scale = balance(space[6], n, columns)
            augment(space[6], n, ns, nr, keep, h, held, scale, aug)
            E = exponential(aug, na, work)
            for lane in range(LANES):
                collect(E, F, C, D, keep, n, ny, nr, held, lane, scale)
        if t == 0:
            for i in range(nx):
                si = scale if keep[i] < n else 1.0
                for lane in range(LANES):
                    z[(m + i) * LANES + lane] = x0[lane, keep[i]] * si
        advance_and_store(F, nx, ny, m, z, t, t + 1 if varying else T, refs, nr, out)
        if not varying:
            break
