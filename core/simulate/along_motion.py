"""Compiled response of the LPV descriptor model along a recorded motion.

The discretised matrices F are interpolated between d node postures
(core.simulate.posture_interpolation), so that a sample costs d products instead of a matrix
exponential:

    x_next = sum_k w_k F_k [r; x],    y = [D C] [r; x].

Here the lanes of the vector unit hold the rows of one system: its d matrices then stay in the
first-level cache, which eight systems side by side would overflow. The exponentials are made for
eight pairs of system and node at a time.
"""

from __future__ import annotations

import numpy as np

from ..arm.signatures import (
    OPTIONS,
    addresses,
    cube,
    dynamics_of,
    kernel,
    linear_of,
    matrix,
    vector,
)
from ..compiler import int64, njit, types
from ..lanes.functions import INLINE
from ..lanes.rows import dot1, dot4, dot8, dot12, put_rows
from ..lanes.wide import LANES
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

TOGETHER = 2
"""Systems that advance in turns: each sample waits for the one before, and while one system waits
the other works."""

ROWS = 4
"""Vectors of rows are made up to a multiple of it, so that few loops are needed."""


@njit(**INLINE)
def tall_product(A, vectors, x, x0, n, y, y0):  # type: ignore[no-untyped-def]
    """y = A x for one A (vectors LANES, n) that stands column by column; x (n,) and y from x0
    and y0 on. The number of vectors is a multiple of ROWS."""
    r = 0
    while r + 12 <= vectors:
        put_rows(y, y0 + r, dot12(A, r, vectors, x, x0, n))
        r += 12
    if r + 8 <= vectors:
        put_rows(y, y0 + r, dot8(A, r, vectors, x, x0, n))
        r += 8
    if r < vectors:
        put_rows(y, y0 + r, dot4(A, r, vectors, x, x0, n))


@njit(**OPTIONS)
def place_all(  # type: ignore[no-untyped-def]
    dynamics, linear, p, laws, C, D, nodes, h, keep, hold, first, last, tall, column, wide_rows
):
    """Fills tall (systems, ..) for the systems first..last-1; returns the unit of q."""
    d, n, nr, ns = nodes.shape[0], nodes.shape[1], laws[0].shape[2], laws[3].shape[2]
    nx = keep.size
    m = nr if hold else 2 * nr
    na = m + nx
    space, steps = work_arrays(n, ns, nr), np.full((1, LANES), h)
    aug, work = aligned(na * na), aligned(5 * na * na).reshape((5, na * na, LANES))
    pairs, unit = (last - first) * d, 0.0
    for first_pair in range(0, pairs, LANES):
        for lane in range(LANES):
            pair = min(first_pair + lane, pairs - 1)
            s = first + pair // d
            place(dynamics, linear, p[s], nodes[pair % d], laws, s, lane, space)
        E, unit = discretised(space, n, nr, 2 * n + ns + nr, keep, steps, unit, aug, na, work)
        for lane in range(min(LANES, pairs - first_pair)):
            s, k = (first_pair + lane) // d, (first_pair + lane) % d
            write_step(E[:, lane].copy(), nx, m, nr, hold, tall[s], column, k * wide_rows)
    for s in range(last - first):
        write_outputs(C[first + s], D[first + s], keep, n, m, unit, tall[s], column, d * wide_rows)
    return unit


@njit(**OPTIONS)
def follow(tall, state_vectors, d, m, nx, nr, ny, refs, shares, z, y, out, s, stop):  # type: ignore[no-untyped-def]
    """Writes out[:, :, s:stop], at most TOGETHER; z holds [r; x] per system, y has room for rows.

    x stands in z at a multiple of LANES, where the start is.
    """
    vectors = tall.shape[1] // (m + nx)
    T, at, first = out.shape[0], -(-m // LANES) * LANES, d * state_vectors * LANES
    size, tall_size = at + state_vectors * LANES, vectors * LANES
    numbers, rows = z.reshape(z.size), y.reshape(y.size)
    for t in range(T):
        for k in range(stop - s):
            begin = k * size + at - m
            for i in range(m):
                numbers[begin + i] = refs[t * nr + i]
            tall_product(tall[s + k], vectors, numbers, begin, m + nx, y, k * vectors)
            for i in range(ny):
                out[t, i, s + k] = rows[k * tall_size + first + i]
            for r in range(state_vectors):
                # The blend of the nodes is itself such a product: columns are nodes.
                blend = dot1(y, k * vectors + r, state_vectors, shares, t * d, d)
                put_rows(z, (k * size + at) // LANES + r, blend)


@kernel(
    types.void(
        addresses, matrix, LAWS, cube, cube, matrix, types.float64, types.int64[::1],
        types.boolean, matrix, vector, vector, cube, int64, int64,
    ),
)  # fmt: skip
def followed(  # type: ignore[no-untyped-def]
    arm, p, laws, C, D, nodes, h, keep, hold, x0, refs, shares, out, first, last
):
    """Outputs of the systems first..last-1 along one motion, to out (T, ny, last - first).

    arm (3,): the addresses of its functions.
    p (S, np), laws, C (S, ny, N), D (S, ny, nr), x0 (S, N) of all S systems; nodes (d, n)
    postures, shares (T, d) flat, h in s, keep (nx,) the states that matter, refs
    (T + 1, nr) flat.
    """
    dynamics, linear = dynamics_of(arm), linear_of(arm)
    d, n, nr, ny, nx = nodes.shape[0], nodes.shape[1], laws[0].shape[2], C.shape[1], keep.size
    m = nr if hold else 2 * nr
    na = m + nx
    state_vectors = -(-nx // LANES)
    vectors = -(-(d * state_vectors + -(-ny // LANES)) // ROWS) * ROWS
    count, entries = last - first, na * vectors
    tall = aligned(count * entries).reshape((count, entries, LANES))
    unit = place_all(
        dynamics, linear, p, laws, C, D, nodes, h, keep, hold, first, last,
        tall.reshape((count, entries * LANES)), vectors * LANES, state_vectors * LANES,
    )  # fmt: skip
    at = -(-m // LANES)
    size = at + state_vectors
    z, y = aligned(TOGETHER * size), aligned(TOGETHER * vectors)
    numbers = z.reshape(z.size)
    for s in range(0, count, TOGETHER):
        stop = min(s + TOGETHER, count)
        for k in range(stop - s):
            start(x0[first + s + k], keep, n, unit, numbers[(k * size + at) * LANES :])
        follow(tall, state_vectors, d, m, nx, nr, ny, refs, shares, z, y, out, s, stop)
