"""Compiled response of the LPV descriptor model, E(kappa) x' = A(kappa) x + B r.

State x = [q, q', s] with the drive's feedback closed, (11) of the paper for a velocity loop.
E is never inverted in the model's statement; here its Cholesky-sized solve happens once per
working point, then the discretisation is exact for the drive's kind of hold.
"""

from __future__ import annotations

import numpy as np
from numba import int64, njit, types

from core.arm.signatures import DYNAMICS, LINEAR, OPTIONS, matrix, vector
from core.simulate.closed import augment, balance, place, room, solve
from core.simulate.lanes import advance_and_compare, advance_and_store, aligned, exponential
from core.simulate.vector import LANES

cube = types.float64[:, :, ::1]


@njit(**OPTIONS)
def lane_sums(total, ny):  # type: ignore[no-untyped-def]
    """(LANES,) from (ny LANES,)."""
    sums = np.zeros(LANES)
    for i in range(ny):
        for lane in range(LANES):
            sums[lane] += total[i * LANES + lane]
    return sums


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


@njit(**OPTIONS)
def one_pass(  # type: ignore[no-untyped-def]
    dynamics, linear, p, laws, C, D, schedule, varying, h, keep, held, x0, refs, measured,
    weights, out, store,
):  # fmt: skip
    """As `respond`, compiled."""
    n, nr, ns = schedule.shape[2], laws[0].shape[2], laws[3].shape[2]
    ny, nx = C.shape[1], keep.size
    m = nr if held else 2 * nr
    na = nx + m
    T = refs.size // (nr * LANES) - 1
    q, space, columns = np.empty(n), room(n, ns, nr), 2 * n + ns + nr
    aug, work = aligned(na * na * LANES), aligned(5 * na * na * LANES).reshape(5, -1)
    F = aligned((nx + ny) * na * LANES)
    z, total = aligned(2 * (na + ny) * LANES), np.zeros(ny * LANES)
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
        stop = t + 1 if varying else T
        if store:
            advance_and_store(F, nx, ny, m, z, t, stop, refs, nr, out)
        else:
            advance_and_compare(F, nx, ny, m, z, t, stop, refs, nr, measured, weights, total)
        if not varying:
            break
    return lane_sums(total, ny)


POPULATION = types.Tuple((types.float64[:, :, :, ::1],) * 8)
"""R, P, V, S, Fs, Fq, Fv, Fr of core.drives.law.DriveLaw; members, then lanes, come first."""


@njit(
    types.void(
        DYNAMICS, LINEAR, cube, POPULATION, types.float64[:, :, :, ::1],
        types.float64[:, :, :, ::1], cube, types.boolean, vector, types.int64[::1],
        types.boolean, matrix, vector, vector, vector, vector, types.boolean, matrix, int64,
        int64,
    ),
    **OPTIONS,
)  # fmt: skip
def all_passes(  # type: ignore[no-untyped-def]
    dynamics, linear, p, laws, C, D, schedule, varying, h, keep, held, x0, refs, measured,
    weights, out, store, costs, first, last,
):  # fmt: skip
    """The only entry from Python: each one compiles everything below it once more."""
    R, P, V, S, Fs, Fq, Fv, Fr = laws
    for s in range(first, last):
        law = (R[s], P[s], V[s], S[s], Fs[s], Fq[s], Fv[s], Fr[s])
        found = one_pass(
            dynamics, linear, p[s], law, C[s], D[s], schedule, varying, h, keep, held, x0, refs,
            measured, weights, out, store,
        )  # fmt: skip
        for lane in range(LANES):
            costs[s, lane] = found[lane]


def respond(  # type: ignore[no-untyped-def]
    dynamics, linear, p, laws, C, D, schedule, varying, h, keep, held, x0, refs, measured,
    weights, out, store,
):  # fmt: skip
    """Response of LANES experiments; returns the weighted squared error per lane (LANES,).

    p (LANES, np); C (LANES, ny, N) and D (LANES, ny, nr) outputs over the full state of
    N = 2 n + ns; schedule (T, LANES, n) joint positions, only its first row where the model is
    not `varying`; h (LANES,) sample times in s; keep (nx,) the states that matter; x0
    (LANES, N); refs (T + 1, nr, LANES), measured, weights and out (T, ny, LANES) flat.
    """
    costs = np.empty((1, LANES))
    all_passes(
        dynamics, linear, p[None], tuple(law[None] for law in laws), C[None], D[None], schedule,
        varying, h, keep, held, x0, refs, measured, weights, out, store, costs, 0, 1,
    )  # fmt: skip
    return costs[0]


_NOTHING = np.empty(0)


def population_costs(  # type: ignore[no-untyped-def]
    dynamics, linear, p, laws, C, D, schedule, h, keep, held, x0, refs, measured, weights, costs,
    first, last,
):  # fmt: skip
    """costs[s] (LANES,) for the members first..last-1; p (S, LANES, np), the rest likewise."""
    all_passes(
        dynamics, linear, p, laws, C, D, schedule, False, h, keep, held, x0, refs, measured,
        weights, _NOTHING, False, costs, first, last,
    )  # fmt: skip
