"""Compiled response of the LPV descriptor model, piece by piece instead of sample by sample.

At a working point, over a piece with held references, the state needs one step and the outputs
are one product,

    x_next = F_l [r; x],    [y_0; y_1; ...] = [C D; (C D) S; (C D) S^2; ...] [r; x],

with the one-sample step S of [r; x] and F_l the lower rows of S^l. The last axis of every array
holds LANES independent systems, see core.simulate.lanes.
"""

from __future__ import annotations

import numpy as np
from numba import int64, njit, types

from core.arm.signatures import OPTIONS, cube, dynamics_at, kernel, linear_at, matrix, vector
from core.lanes.functions import INLINE
from core.simulate import vector as wide
from core.simulate.closed import augment, balance, place, solve, work_arrays
from core.simulate.lanes import aligned, apply_part, exponential, product
from core.simulate.vector import LANES, move

compare1, compare2, compare4, compare8 = (
    wide.compare1, wide.compare2, wide.compare4, wide.compare8
)  # fmt: skip
weigh1, weigh2, weigh4, weigh8 = wide.weigh1, wide.weigh2, wide.weigh4, wide.weigh8

POPULATION = types.Tuple((types.float64[:, :, :, ::1],) * 8)
"""R, P, V, S, Fs, Fq, Fv, Fr of core.drives.law.DriveLaw; passes, then lanes, come first."""

COMPARE, WEIGH, STORE = range(3)
"""What happens to outputs: squared errors, weighted squared errors, or they are written."""


@njit(**INLINE)
def compare(A, column, rows, x, x0, n, measured, m0, weights, total):  # type: ignore[no-untyped-def]
    """total (LANES,) += sum (measured - A x)^2 over the first `rows` rows of A."""
    r = 0
    while r + 8 <= rows:
        compare8(A, r * LANES, column, x, x0, n, measured, m0 + r * LANES, weights, 0, total)
        r += 8
    if r + 4 <= rows:
        compare4(A, r * LANES, column, x, x0, n, measured, m0 + r * LANES, weights, 0, total)
        r += 4
    if r + 2 <= rows:
        compare2(A, r * LANES, column, x, x0, n, measured, m0 + r * LANES, weights, 0, total)
        r += 2
    if r < rows:
        compare1(A, r * LANES, column, x, x0, n, measured, m0 + r * LANES, weights, 0, total)


@njit(**INLINE)
def weigh(A, column, rows, x, x0, n, measured, m0, weights, total):  # type: ignore[no-untyped-def]
    """As `compare`, each square times its weight; weights stand as measured does."""
    r = 0
    while r + 4 <= rows:
        at = m0 + r * LANES
        weigh4(A, r * LANES, column, x, x0, n, measured, at, weights, at, total)
        r += 4
    if r + 2 <= rows:
        at = m0 + r * LANES
        weigh2(A, r * LANES, column, x, x0, n, measured, at, weights, at, total)
        r += 2
    if r < rows:
        at = m0 + r * LANES
        weigh1(A, r * LANES, column, x, x0, n, measured, at, weights, at, total)


@njit(**OPTIONS)
def square_step(E, keep, n, m, nr, held, lane, S):  # type: ignore[no-untyped-def]
    """One lane of S (na, na): one sample of [r; x] from the exponential E of [x; r]."""
    nx = keep.size
    na = m + nx
    for i in range(m):
        for j in range(na):
            S[(j * na + i) * LANES + lane] = 1.0 if i == j else 0.0
    for i in range(nx):
        for j in range(nx):
            S[((m + j) * na + m + i) * LANES + lane] = E[(j * na + i) * LANES + lane]
        for j in range(nr):
            first = E[((nx + j) * na + i) * LANES + lane]
            if held:
                S[(j * na + m + i) * LANES + lane] = first
            else:
                later = E[((nx + nr + j) * na + i) * LANES + lane]
                S[(j * na + m + i) * LANES + lane] = first - later
                S[((nr + j) * na + m + i) * LANES + lane] = later


@njit(**OPTIONS)
def first_outputs(C, D, keep, n, m, nr, unit, lane, rows, Y):  # type: ignore[no-untyped-def]
    """One lane of the outputs' first rows [D C] in Y (rows, na)."""
    for i in range(C.shape[1]):
        for j in range(m):
            Y[(j * rows + i) * LANES + lane] = D[lane, i, j] if j < nr else 0.0
        for j in range(keep.size):
            sj = unit if keep[j] < n else 1.0
            Y[((m + j) * rows + i) * LANES + lane] = C[lane, i, keep[j]] / sj


@njit(**OPTIONS)
def copy_step(S, m, nx, F, f):  # type: ignore[no-untyped-def]
    """F (nx, m + nx) from place f on: the lower rows of S."""
    na = m + nx
    for j in range(na):
        for i in range(nx):
            move(F, f + (j * nx + i) * LANES, S, (j * na + m + i) * LANES)


@njit(**OPTIONS)
def raise_steps(work, m, nx, ny, lengths, longest, F, stride, Y):  # type: ignore[no-untyped-def]
    """Powers and output rows by doubling: work[0] holds S, Y its first ny rows.

    The step over lengths[i] samples goes to F from i stride on; Y gets longest ny rows.
    """
    na = m + nx
    rows = longest * ny
    column = rows * LANES
    P, Q = 0, 1
    begun = np.zeros(lengths.size, dtype=np.bool_)
    done, bit = 1, 1
    while True:
        for i in range(lengths.size):
            if lengths[i] & bit:
                mine = 3 + i
                if begun[i]:
                    product(work[2], work[mine], work[P], na)
                    for e in range(0, na * na * LANES, LANES):
                        move(work[mine], e, work[2], e)
                else:
                    begun[i] = True
                    for e in range(0, na * na * LANES, LANES):
                        move(work[mine], e, work[P], e)
        if done < longest:
            more = min(done, longest - done)
            for j in range(na):
                at = j * column + done * ny * LANES
                apply_part(Y, 0, column, more * ny, work[P], j * na * LANES, na, Y, at)
            done += more
        bit *= 2
        if bit > longest:
            break
        product(work[Q], work[P], work[P], na)
        P, Q = Q, P
    for i in range(lengths.size):
        copy_step(work[3 + i], m, nx, F, i * stride)


@njit(**OPTIONS)
def build(  # type: ignore[no-untyped-def]
    dynamics, linear, p, laws, C, D, postures, h, keep, held, lengths, longest, F, Y, steps, aug,
    work, space,
):  # fmt: skip
    """Fills F (lengths, na columns of nx) and Y; returns the unit of q in the states."""
    n, nr, ns = postures.shape[1], laws[0].shape[2], laws[3].shape[2]
    ny, nx = C.shape[1], keep.size
    m = nr if held else 2 * nr
    na, columns = m + nx, 2 * n + ns + nr
    for lane in range(LANES):
        place(dynamics, linear, p[lane], postures[lane], laws, lane, lane, space)
    solve(space[5], n, space[6], columns)
    unit = balance(space[6], n, columns)
    augment(space[6], n, ns, nr, keep, h, held, unit, aug)
    E = exponential(aug, na, work)
    for lane in range(LANES):
        square_step(E, keep, n, m, nr, held, lane, steps[0])
        first_outputs(C, D, keep, n, m, nr, unit, lane, longest * ny, Y)
    raise_steps(steps, m, nx, ny, lengths, longest, F, na * nx * LANES, Y)
    return unit


@njit(**OPTIONS)
def march(  # type: ignore[no-untyped-def]
    F, Y, nx, ny, m, nr, longest, z, refs, pieces, mode, measured, weights, total,
    out,
):  # fmt: skip
    """Goes through the pieces; z: two buffers [r; x] that take turns, the first holds the start."""
    na = m + nx
    column = longest * ny * LANES
    for b in range(pieces.shape[1]):
        t, old = pieces[0, b], (b & 1) * na * LANES
        new = na * LANES - old
        for i in range(0, m * LANES, LANES):
            move(z, old + i, refs, t * nr * LANES + i)
        f = pieces[2, b] * na * nx * LANES
        apply_part(F, f, nx * LANES, nx, z, old, na, z, new + m * LANES)
        rows, at = pieces[1, b] * ny, t * ny * LANES
        if mode == COMPARE:
            compare(Y, column, rows, z, old, na, measured, at, weights, total)
        elif mode == WEIGH:
            weigh(Y, column, rows, z, old, na, measured, at, weights, total)
        else:
            apply_part(Y, 0, column, rows, z, old, na, out, at)


@kernel(
    types.void(
        types.int64[::1], cube, POPULATION, types.float64[:, :, :, ::1],
        types.float64[:, :, :, ::1], matrix, vector, types.int64[::1], types.boolean, cube, vector,
        types.int64[::1], types.int64[:, ::1], int64, vector, vector, matrix, matrix, int64, int64,
    ),
)  # fmt: skip
def piecewise(  # type: ignore[no-untyped-def]
    arm, p, laws, C, D, postures, h, keep, held, x0, refs, lengths, pieces, mode,
    measured, weights, costs, out, first, last,
):  # fmt: skip
    """The passes first..last-1 of LANES systems each; the only entry from Python.

    arm (2,): the addresses of its dynamics and linear functions.
    p (passes, LANES, np), laws, C (passes, LANES, ny, N), D (passes, LANES, ny, nr) and x0
    (passes, LANES, N) belong to the passes, the rest to all of them: postures (LANES, n), h
    (LANES,) in s, keep (nx,) the states that matter, refs (T + 1, nr, LANES) flat; pieces
    (3, B), their first samples, numbers of samples and places among the distinct `lengths`.
    Writes costs (passes, LANES) from measured and weights (T, ny, LANES) flat, or
    out (passes, T ny LANES), as `mode` says.
    """
    R, P, V, S, Fs, Fq, Fv, Fr = laws
    dynamics, linear = dynamics_at(arm[0]), linear_at(arm[1])
    n, nr = postures.shape[1], R.shape[3]
    ny, nx = C.shape[2], keep.size
    m = nr if held else 2 * nr
    na, longest = m + nx, lengths.max()
    square = na * na * LANES
    aug, work = aligned(square), aligned(5 * square).reshape(5, -1)
    steps = aligned((3 + lengths.size) * square).reshape(-1, square)
    F, Y = aligned(lengths.size * nx * na * LANES), aligned(longest * ny * na * LANES)
    z, total = aligned(2 * na * LANES), aligned(LANES)
    space = work_arrays(n, S.shape[3], nr)
    for s in range(first, last):
        law = (R[s], P[s], V[s], S[s], Fs[s], Fq[s], Fv[s], Fr[s])
        unit = build(
            dynamics, linear, p[s], law, C[s], D[s], postures, h, keep, held, lengths, longest,
            F, Y, steps, aug, work, space,
        )  # fmt: skip
        for i in range(nx):
            si = unit if keep[i] < n else 1.0
            for lane in range(LANES):
                z[(m + i) * LANES + lane] = x0[s, lane, keep[i]] * si
        for lane in range(LANES):
            total[lane] = 0.0
        march(
            F, Y, nx, ny, m, nr, longest, z, refs, pieces, mode, measured,
            weights, total, out[s] if mode == STORE else out[0],
        )  # fmt: skip
        for lane in range(LANES):
            costs[s, lane] = total[lane]
