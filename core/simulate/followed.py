"""Compiled response of the LPV descriptor model along a recorded motion.

The discretised matrices F are interpolated between d node postures (core.simulate.postures), so
that a sample costs d products instead of a matrix exponential:

    x_next = sum_k w_k F_k [r; x],    y = [D C] [r; x].

Here the lanes of the vector unit hold the rows of one system: its d matrices then stay in the
first-level cache, which eight systems side by side would overflow. The exponentials are made for
eight pairs of system and node at a time.
"""

from __future__ import annotations

import numpy as np
from numba import int64, njit, types

from core.arm.signatures import OPTIONS, cube, dynamics_at, kernel, linear_at, matrix, vector
from core.lanes.functions import INLINE
from core.simulate import vector as wide
from core.simulate.closed import augment, balance, place, solve, work_arrays
from core.simulate.lanes import aligned, exponential
from core.simulate.lpv import LAWS
from core.simulate.vector import LANES

rows1, rows4, rows8, rows12 = wide.rows1, wide.rows4, wide.rows8, wide.rows12

TOGETHER = 2
"""Systems that advance in turns: each sample waits for the one before, and while one system waits
the other works."""

ROWS = 4
"""Vectors of rows are made up to a multiple of it, so that few loops are needed."""


@njit(**INLINE)
def tall_product(A, vectors, x, x0, n, y, y0):  # type: ignore[no-untyped-def]
    """y = A x for one A (vectors LANES, n) that stands column by column; x (n,) and y from x0
    and y0 on. The number of vectors is a multiple of ROWS."""
    column, r = vectors * LANES, 0
    while r + 12 <= vectors:
        rows12(A, r * LANES, column, x, x0, n, y, y0 + r * LANES)
        r += 12
    if r + 8 <= vectors:
        rows8(A, r * LANES, column, x, x0, n, y, y0 + r * LANES)
        r += 8
    if r < vectors:
        rows4(A, r * LANES, column, x, x0, n, y, y0 + r * LANES)


@njit(**OPTIONS)
def place_step(E, nx, m, nr, held, lane, A, column, first):  # type: ignore[no-untyped-def]
    """Rows first.. of A, column by column: the next state from [r; x], of one lane of E."""
    na = m + nx
    for i in range(nx):
        for j in range(nx):
            A[(m + j) * column + first + i] = E[(j * na + i) * LANES + lane]
        for j in range(nr):
            now = E[((nx + j) * na + i) * LANES + lane]
            if held:
                A[j * column + first + i] = now
            else:
                later = E[((nx + nr + j) * na + i) * LANES + lane]
                A[j * column + first + i] = now - later
                A[(nr + j) * column + first + i] = later


@njit(**OPTIONS)
def place_outputs(C, D, s, keep, n, m, unit, A, column, first):  # type: ignore[no-untyped-def]
    """Rows first.. of A: the outputs [D C] of system s; the inputs' second half has none."""
    for i in range(C.shape[1]):
        for j in range(D.shape[2]):
            A[j * column + first + i] = D[s, i, j]
        for j in range(keep.size):
            A[(m + j) * column + first + i] = C[s, i, keep[j]] / (unit if keep[j] < n else 1.0)


@njit(**OPTIONS)
def place_all(  # type: ignore[no-untyped-def]
    dynamics, linear, p, laws, C, D, nodes, h, keep, held, first, last, tall, column, wide_rows
):
    """Fills tall (systems, ..) for the systems first..last-1; returns the unit of q."""
    d, n, nr, ns = nodes.shape[0], nodes.shape[1], laws[0].shape[2], laws[3].shape[2]
    nx = keep.size
    m = nr if held else 2 * nr
    na, columns = m + nx, 2 * n + ns + nr
    space, steps = work_arrays(n, ns, nr), np.full(LANES, h)
    aug, work = aligned(na * na * LANES), aligned(5 * na * na * LANES).reshape(5, -1)
    pairs, unit = (last - first) * d, 1.0
    for start in range(0, pairs, LANES):
        for lane in range(LANES):
            pair = min(start + lane, pairs - 1)
            s = first + pair // d
            place(dynamics, linear, p[s], nodes[pair % d], laws, s, lane, space)
        solve(space[5], n, space[6], columns)
        if start == 0:
            unit = balance(space[6], n, columns)
        augment(space[6], n, ns, nr, keep, steps, held, unit, aug)
        E = exponential(aug, na, work)
        for lane in range(min(LANES, pairs - start)):
            s, k = (start + lane) // d, (start + lane) % d
            place_step(E, nx, m, nr, held, lane, tall[s], column, k * wide_rows)
    for s in range(last - first):
        place_outputs(C, D, first + s, keep, n, m, unit, tall[s], column, d * wide_rows)
    return unit


@njit(**OPTIONS)
def follow(tall, vectors, state_vectors, d, m, nx, nr, ny, refs, shares, z, y, out, s, stop):  # type: ignore[no-untyped-def]
    """Writes out[:, :, s:stop], at most TOGETHER; z holds [r; x] per system, y has room for rows.

    x stands in z at a multiple of LANES, where the start is.
    """
    T, at, first = out.shape[0], -(-m // LANES) * LANES, d * state_vectors * LANES
    size, tall_size = at + state_vectors * LANES, vectors * LANES
    for t in range(T):
        for k in range(stop - s):
            for i in range(m):
                z[k * size + at - m + i] = refs[t * nr + i]
            tall_product(tall[s + k], vectors, z, k * size + at - m, m + nx, y, k * tall_size)
            for i in range(ny):
                out[t, i, s + k] = y[k * tall_size + first + i]
            for r in range(state_vectors):
                # The blend of the nodes is itself such a product: columns are nodes.
                rows1(
                    y, k * tall_size + r * LANES, state_vectors * LANES, shares, t * d, d, z,
                    k * size + at + r * LANES,
                )  # fmt: skip


@kernel(
    types.void(
        types.int64[::1], matrix, LAWS, cube, cube, matrix, types.float64, types.int64[::1],
        types.boolean, matrix, vector, vector, cube, int64, int64,
    ),
)  # fmt: skip
def followed(  # type: ignore[no-untyped-def]
    arm, p, laws, C, D, nodes, h, keep, held, x0, refs, shares, out, first, last
):
    """Outputs of the systems first..last-1 along one motion, to out (T, ny, last - first).

    arm (2,): the addresses of its dynamics and linear functions.
    p (S, np), laws, C (S, ny, N), D (S, ny, nr), x0 (S, N) of all S systems; nodes (d, n)
    postures, shares (T, d) flat, h in s, keep (nx,) the states that matter, refs
    (T + 1, nr) flat.
    """
    dynamics, linear = dynamics_at(arm[0]), linear_at(arm[1])
    d, n, nr, ny, nx = nodes.shape[0], nodes.shape[1], laws[0].shape[2], C.shape[1], keep.size
    m = nr if held else 2 * nr
    na = m + nx
    state_vectors = -(-nx // LANES)
    vectors = -(-(d * state_vectors + -(-ny // LANES)) // ROWS) * ROWS
    column = vectors * LANES
    tall = aligned((last - first) * na * column).reshape(last - first, -1)
    tall[:] = 0.0
    unit = place_all(
        dynamics, linear, p, laws, C, D, nodes, h, keep, held, first, last, tall, column,
        state_vectors * LANES,
    )  # fmt: skip
    at = -(-m // LANES) * LANES
    size = at + state_vectors * LANES
    z, y = aligned(TOGETHER * size), aligned(TOGETHER * column)
    for s in range(0, last - first, TOGETHER):
        stop = min(s + TOGETHER, last - first)
        for k in range(stop - s):
            for i in range(nx):
                start = x0[first + s + k, keep[i]]
                z[k * size + at + i] = start * (unit if keep[i] < n else 1.0)
        follow(tall, vectors, state_vectors, d, m, nx, nr, ny, refs, shares, z, y, out, s, stop)
