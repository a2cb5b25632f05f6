"""Exact discretisation and response of LANES small linear systems side by side.

The last axis of every array holds LANES independent systems (experiments of a cost, say), so
that one vector instruction advances all of them. Arrays are flat float64; a matrix (r, c) of
lanes stands column by column, so that a product with a vector reads it from end to end.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from core.arm.signatures import OPTIONS
from core.lanes.functions import INLINE
from core.simulate.vector import LANES, axpy, dot1, dot2, dot4, dot8, move

TAYLOR_DEGREE = 16
TAYLOR_RADIUS = 0.78
"""Norm up to which Taylor's polynomial of that degree is exact to rounding
(Higham, Functions of Matrices, 2008, table 10.2: theta_16 = 0.783)."""

MAX_SQUARINGS = 60
COEFFICIENTS = np.array([1.0 / float(np.prod(np.arange(1.0, k + 1.0))) for k in range(17)])


@njit(**OPTIONS)
def aligned(size):  # type: ignore[no-untyped-def]
    """(size,) float64 that starts on a cache line: a vector that straddles two costs twice."""
    memory = np.empty(size + LANES)
    start = (-memory.ctypes.data % (8 * LANES)) // 8
    return memory[start : start + size]


@njit(**INLINE)
def apply_part(A, a, column, rows, x, x0, n, y, y0):  # type: ignore[no-untyped-def]
    """As `apply`, for `rows` rows of A from a on, whose columns stand `column` apart."""
    r = 0
    while r + 8 <= rows:
        dot8(A, a + r * LANES, column, x, x0, n, y, y0 + r * LANES)
        r += 8
    if r + 4 <= rows:
        dot4(A, a + r * LANES, column, x, x0, n, y, y0 + r * LANES)
        r += 4
    if r + 2 <= rows:
        dot2(A, a + r * LANES, column, x, x0, n, y, y0 + r * LANES)
        r += 2
    if r < rows:
        dot1(A, a + r * LANES, column, x, x0, n, y, y0 + r * LANES)


@njit(**INLINE)
def apply(A, rows, x, x0, n, y, y0):  # type: ignore[no-untyped-def]
    """y = A x per lane: A (rows, n), x (n) from x0 on, y (rows) from y0 on, each LANES wide."""
    apply_part(A, 0, rows * LANES, rows, x, x0, n, y, y0)


@njit(**OPTIONS)
def product(out, A, B, n):  # type: ignore[no-untyped-def]
    """out = A B per lane; (n, n, LANES) each, out is neither A nor B."""
    for j in range(0, n * n * LANES, n * LANES):
        apply(A, n, B, j, n, out, j)


@njit(**OPTIONS)
def largest_norm(A, n):  # type: ignore[no-untyped-def]
    """The largest row-sum norm of the lanes."""
    norm = 0.0
    sums = np.empty(LANES)
    for i in range(n):
        for lane in range(LANES):
            sums[lane] = 0.0
        for j in range(n):
            for lane in range(LANES):
                sums[lane] += abs(A[(i * n + j) * LANES + lane])
        for lane in range(LANES):
            norm = max(norm, sums[lane])
    return norm


@njit(**OPTIONS)
def add_powers(out, A1, A2, A3, first, n):  # type: ignore[no-untyped-def]
    """out += c[first] I + c[first + 1] A + c[first + 2] A^2 + c[first + 3] A^3."""
    for e in range(0, n * n * LANES, LANES):
        axpy(out, e, COEFFICIENTS[first + 1], A1, e)
        axpy(out, e, COEFFICIENTS[first + 2], A2, e)
        axpy(out, e, COEFFICIENTS[first + 3], A3, e)
    for i in range(n):
        for lane in range(LANES):
            out[i * (n + 1) * LANES + lane] += COEFFICIENTS[first]


@njit(**OPTIONS)
def exponential(A, n, work):  # type: ignore[no-untyped-def]
    """exp(A) per lane by Taylor's polynomial of degree 16, scaled and squared.

    A (n, n, LANES) flat is overwritten; work (5, n n LANES); returns the row of work with the
    result.
    """
    size = n * n * LANES
    A2, A3, A4, out, tmp = work[0], work[1], work[2], work[3], work[4]
    norm = largest_norm(A, n)
    squarings, scale = 0, 1.0
    while norm * scale > TAYLOR_RADIUS and squarings < MAX_SQUARINGS:
        scale *= 0.5
        squarings += 1
    for e in range(size):
        A[e] *= scale
    product(A2, A, A, n)
    product(A3, A2, A, n)
    product(A4, A2, A2, n)
    for e in range(size):
        tmp[e] = COEFFICIENTS[16] * A4[e]
    add_powers(tmp, A, A2, A3, 12, n)
    for first in (8, 4, 0):
        product(out, A4, tmp, n)
        add_powers(out, A, A2, A3, first, n)
        out, tmp = tmp, out
    out, tmp = tmp, out
    for _ in range(squarings):
        product(tmp, out, out, n)
        out, tmp = tmp, out
    return out


@njit(**INLINE)
def advance(F, nx, ny, m, z, t, refs, nr):  # type: ignore[no-untyped-def]
    """One step of [x; y] from [r; x]; returns where the outputs y of sample t stand in z.

    F (nx + ny, m + nx, LANES): the next state, then the outputs, from m references (nr held,
    2 nr where they run straight between samples) and the state. z: two buffers [r; x; y] of
    (m + nx + ny) LANES that take turns; sample t reads buffer t % 2. The references stand
    first because the state comes late: it waits for the step before.
    """
    size = (m + nx + ny) * LANES
    old = (t & 1) * size
    new = size - old
    for i in range(0, m * LANES, LANES):
        move(z, old + i, refs, t * nr * LANES + i)
    apply(F, nx + ny, z, old, m + nx, z, new + m * LANES)
    return new + (m + nx) * LANES


@njit(**OPTIONS)
def advance_and_store(F, nx, ny, m, z, start, stop, refs, nr, out):  # type: ignore[no-untyped-def]
    """Advances over samples start..stop-1 and writes the outputs to out (N, ny, LANES); F and z
    as in `advance`, refs (N + 1, nr, LANES)."""
    wide = ny * LANES
    for t in range(start, stop):
        y = advance(F, nx, ny, m, z, t, refs, nr)
        for i in range(0, wide, LANES):
            move(out, t * wide + i, z, y + i)
