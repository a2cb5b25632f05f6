"""Compiled response of the LPV descriptor model, E(kappa) x' = A(kappa) x + B r.

State x = [q, q', s] with the drive's feedback closed, (11) of the paper for a velocity loop.
E is never inverted in the model's statement; here its Cholesky-sized solve happens once per
working point, then the discretisation is exact for the drive's kind of hold.
"""

from __future__ import annotations

import numpy as np
from numba import int64, njit, types

from core.simulate.lanes import advance_and_compare, advance_and_store, exponential
from core.arm.signatures import DYNAMICS, LINEAR, OPTIONS, matrix, vector
from core.simulate.small import factor, substitute
from core.simulate.vector import LANES

cube = types.float64[:, :, ::1]
LAWS = types.Tuple((cube, cube, cube, cube, cube, cube, cube, cube))
"""R, P, V, S, Fs, Fq, Fv, Fr of core.drives.law.DriveLaw, one per lane on the first axis."""


@njit(**OPTIONS)
def continuous(dynamics, linear, p, q, laws, lane, A, B, K, D, M, f, pivots, zero, column):  # type: ignore[no-untyped-def]
    """A (2 n + ns, ..) and B (2 n + ns, nr) with the drive closed, at the straight arm in q."""
    R, P, V, S, Fs, Fq, Fv, Fr = laws
    n, ns, joints, nr = q.size, Fs.shape[1], R.shape[1], R.shape[2]
    dynamics(q, zero, p, M, f)
    linear(q, p, K, D)
    factor(M, pivots)
    A[:, :] = 0.0
    B[:, :] = 0.0
    for j in range(n):
        A[j, n + j] = 1.0
        for i in range(n):
            column[i] = -K[i, j] - (P[lane, i, j] if i < joints else 0.0)
        substitute(M, pivots, column)
        for i in range(n):
            A[n + i, j] = column[i]
        for i in range(n):
            column[i] = -D[i, j] - (V[lane, i, j] if i < joints else 0.0)
        substitute(M, pivots, column)
        for i in range(n):
            A[n + i, n + j] = column[i]
    for j in range(ns):
        for i in range(n):
            column[i] = -S[lane, i, j] if i < joints else 0.0
        substitute(M, pivots, column)
        for i in range(n):
            A[n + i, 2 * n + j] = column[i]
    for j in range(nr):
        for i in range(n):
            column[i] = R[lane, i, j] if i < joints else 0.0
        substitute(M, pivots, column)
        for i in range(n):
            B[n + i, j] = column[i]
    for i in range(ns):
        for j in range(n):
            A[2 * n + i, j] = Fq[lane, i, j]
            A[2 * n + i, n + j] = Fv[lane, i, j]
        for j in range(ns):
            A[2 * n + i, 2 * n + j] = Fs[lane, i, j]
        for j in range(nr):
            B[2 * n + i, j] = Fr[lane, i, j]


@njit(**OPTIONS)
def balance(A, n):  # type: ignore[no-untyped-def]
    """A power of two that brings q to the size of q', so that few squarings are needed."""
    largest = 1.0
    for i in range(n):
        for j in range(n):
            largest = max(largest, abs(A[n + i, j]))
    return 2.0 ** np.round(0.5 * np.log2(largest))


@njit(**OPTIONS)
def discretise(A, B, C, D, keep, n, h, lane, held, aug, scale):  # type: ignore[no-untyped-def]
    """Writes one lane of the augmented matrix (na, na, LANES), to be exponentiated."""
    nx, nr = keep.size, B.shape[1]
    na = nx + (nr if held else 2 * nr)
    for i in range(na):
        for j in range(na):
            aug[(i * na + j) * LANES + lane] = 0.0
    for i in range(nx):
        si = scale if keep[i] < n else 1.0
        for j in range(nx):
            sj = scale if keep[j] < n else 1.0
            aug[(i * na + j) * LANES + lane] = h * A[keep[i], keep[j]] * si / sj
        for j in range(nr):
            aug[(i * na + nx + j) * LANES + lane] = h * B[keep[i], j] * si
    if not held:
        for j in range(nr):
            aug[((nx + j) * na + nx + nr + j) * LANES + lane] = 1.0


@njit(**OPTIONS)
def collect(E, F, C, D, keep, n, ny, nr, held, lane, scale):  # type: ignore[no-untyped-def]
    """One lane of F (nx + ny, nx + m, LANES) from the exponential E and the outputs C, D."""
    nx = keep.size
    m = nr if held else 2 * nr
    na, wide = nx + m, nx + m
    for i in range(nx):
        for j in range(nx):
            F[(i * wide + j) * LANES + lane] = E[(i * na + j) * LANES + lane]
        for j in range(nr):
            first = E[(i * na + nx + j) * LANES + lane]
            if held:
                F[(i * wide + nx + j) * LANES + lane] = first
            else:
                later = E[(i * na + nx + nr + j) * LANES + lane]
                F[(i * wide + nx + j) * LANES + lane] = first - later
                F[(i * wide + nx + nr + j) * LANES + lane] = later
    for i in range(ny):
        for j in range(nx):
            sj = scale if keep[j] < n else 1.0
            F[((nx + i) * wide + j) * LANES + lane] = C[lane, i, keep[j]] / sj
        for j in range(m):
            F[((nx + i) * wide + nx + j) * LANES + lane] = D[lane, i, j] if j < nr else 0.0


@njit(
    vector(
        DYNAMICS, LINEAR, matrix, LAWS, cube, cube, cube, types.boolean, vector, types.int64[::1],
        types.boolean, matrix, vector, vector, vector, vector, types.boolean,
    ),
    **OPTIONS,
)  # fmt: skip
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
    n, nr = schedule.shape[2], laws[0].shape[2]
    ny, nx, full = C.shape[1], keep.size, C.shape[2]
    m = nr if held else 2 * nr
    na = nx + m
    T = refs.size // (nr * LANES) - 1
    A, B = np.empty((full, full)), np.empty((full, nr))
    K, Dm, M, f = np.empty((n, n)), np.empty((n, n)), np.empty((n, n)), np.empty(n)
    pivots, zero, column, q = np.empty(n, dtype=np.int64), np.zeros(n), np.empty(n), np.empty(n)
    aug, work = np.empty(na * na * LANES), np.empty((5, na * na * LANES))
    F = np.zeros((nx + ny) * na * LANES)
    x, total = np.empty(2 * nx * LANES), np.zeros(LANES)
    scale = 1.0
    for t in range(T):
        if t == 0 or varying:
            following = min(t + 1, T - 1)
            for lane in range(LANES):
                for i in range(n):
                    q[i] = schedule[0, lane, i]
                    if varying:
                        q[i] = 0.5 * (schedule[t, lane, i] + schedule[following, lane, i])
                continuous(
                    dynamics, linear, p[lane], q, laws, lane, A, B, K, Dm, M, f, pivots, zero,
                    column,
                )  # fmt: skip
                if t == 0 and lane == 0:
                    scale = balance(A, n)
                discretise(A, B, C, D, keep, n, h[lane], lane, held, aug, scale)
            E = exponential(aug, na, work)
            for lane in range(LANES):
                collect(E, F, C, D, keep, n, ny, nr, held, lane, scale)
        if t == 0:
            for i in range(nx):
                si = scale if keep[i] < n else 1.0
                for lane in range(LANES):
                    x[i * LANES + lane] = x0[lane, keep[i]] * si
        stop = t + 1 if varying else T
        if store:
            advance_and_store(F, nx, ny, m, x, t, stop, refs, nr, out)
        else:
            advance_and_compare(F, nx, ny, m, x, t, stop, refs, nr, measured, weights, total)
        if not varying:
            break
    return total


POPULATION = types.Tuple((types.float64[:, :, :, ::1],) * 8)


@njit(
    types.void(
        DYNAMICS, LINEAR, cube, POPULATION, types.float64[:, :, :, ::1],
        types.float64[:, :, :, ::1], cube, vector, types.int64[::1], types.boolean, matrix,
        vector, vector, vector, matrix, int64, int64,
    ),
    **OPTIONS,
)  # fmt: skip
def population_costs(  # type: ignore[no-untyped-def]
    dynamics, linear, p, laws, C, D, schedule, h, keep, held, x0, refs, measured, weights, costs,
    first, last,
):  # fmt: skip
    """costs[s] (LANES,) for the members first..last-1; p (S, LANES, np), the rest likewise."""
    nothing = np.empty(0)
    R, P, V, S, Fs, Fq, Fv, Fr = laws
    for s in range(first, last):
        law = (R[s], P[s], V[s], S[s], Fs[s], Fq[s], Fv[s], Fr[s])
        costs[s] = respond(
            dynamics, linear, p[s], law, C[s], D[s], schedule, False, h, keep, held, x0, refs,
            measured, weights, nothing, False,
        )  # fmt: skip
