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
from core.lanes.functions import INLINE
from core.lanes.rows import apply
from core.lanes.wide import LANES, get, put
from core.simulate.closed import discretised, place, start, work_arrays
from core.simulate.lanes import aligned, write_outputs, write_step


@njit(**INLINE)
def advance(F, nx, ny, m, z, t, refs, nr):  # type: ignore[no-untyped-def]
    """One step of [x; y] from [r; x]; returns where the outputs y of sample t stand in z.

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
    return new + m + nx


@njit(**OPTIONS)
def advance_and_store(F, nx, ny, m, z, start, stop, refs, nr, out):  # type: ignore[no-untyped-def]
    """Advances over samples start..stop-1 and writes the outputs to out (N ny,); F and z as in
    `advance`, refs ((N + 1) nr,)."""
    for t in range(start, stop):
        y = advance(F, nx, ny, m, z, t, refs, nr)
        for i in range(ny):
            put(out, t * ny + i, get(z, y + i))


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
            write_step(E, nx, m, nr, held, F, nx + ny, 0)
        if t == 0:
            for lane in range(LANES):
                write_outputs(C[lane], D[lane], keep, n, m, unit, F[:, lane], nx + ny, nx)
                start(x0[lane], keep, n, unit, z[m:, lane])
        advance_and_store(F, nx, ny, m, z, t, t + 1 if varying else T, r, nr, y)
        if not varying:
            break
