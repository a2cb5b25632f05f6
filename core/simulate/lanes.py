"""Exact discretisation of LANES small linear systems side by side.

Arrays of wide numbers (entries, LANES) hold LANES independent systems (experiments of a cost, say),
so that one vector instruction advances all of them. A matrix (r, c) stands column by column, so
that a product with a vector reads it from end to end.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from core.arm.signatures import OPTIONS
from core.lanes.functions import INLINE
from core.lanes.rows import apply
from core.lanes.wide import LANES, absolute, get, lane, maximum, put

TAYLOR_DEGREE = 16
TAYLOR_RADIUS = 0.78
"""Norm up to which Taylor's polynomial of that degree is exact to rounding
(Higham, Functions of Matrices, 2008, table 10.2: theta_16 = 0.783)."""

MAX_SQUARINGS = 60
COEFFICIENTS = np.array([1.0 / float(np.prod(np.arange(1.0, k + 1.0))) for k in range(17)])


@njit(**OPTIONS)
def aligned(entries):  # type: ignore[no-untyped-def]
    """Zeros (entries, LANES) on a cache line: a vector that straddles two costs twice."""
    memory = np.zeros((entries + 1) * LANES)
    start = (-memory.ctypes.data % (8 * LANES)) // 8
    return memory[start : start + entries * LANES].reshape((entries, LANES))


@njit(**OPTIONS)
def product(out, A, B, n):  # type: ignore[no-untyped-def]
    """out = A B; (n, n) each, out is neither A nor B."""
    for j in range(0, n * n, n):
        apply(A, 0, n, n, B, j, n, out, j)


@njit(**OPTIONS)
def largest_norm(A, n):  # type: ignore[no-untyped-def]
    """The largest column-sum norm of the lanes."""
    largest, norm = absolute(get(A, 0)), 0.0
    for j in range(n):
        total = 0.0
        for i in range(n):
            total += absolute(get(A, j * n + i))
        largest = maximum(largest, total)
    for k in range(LANES):
        norm = max(norm, lane(largest, k))
    return norm


@njit(**INLINE)
def add_powers(out, A1, A2, A3, first, n):  # type: ignore[no-untyped-def]
    """out += c[first] I + c[first + 1] A + c[first + 2] A^2 + c[first + 3] A^3."""
    c0, c1, c2, c3 = COEFFICIENTS[first : first + 4]
    for e in range(n * n):
        more = c1 * get(A1, e) + c2 * get(A2, e) + c3 * get(A3, e)
        put(out, e, get(out, e) + more)
    for e in range(0, n * n, n + 1):
        put(out, e, get(out, e) + c0)


@njit(**OPTIONS)
def exponential(A, n, work):  # type: ignore[no-untyped-def]
    """exp(A) by Taylor's polynomial of degree 16, scaled and squared.

    A (n, n) is overwritten; work (5, n n, LANES); returns the row of work with the result.
    """
    A2, A3, A4, out, tmp = work[0], work[1], work[2], work[3], work[4]
    norm = largest_norm(A, n)
    squarings, scale = 0, 1.0
    while norm * scale > TAYLOR_RADIUS and squarings < MAX_SQUARINGS:
        scale *= 0.5
        squarings += 1
    for e in range(n * n):
        put(A, e, scale * get(A, e))
    product(A2, A, A, n)
    product(A3, A2, A, n)
    product(A4, A2, A2, n)
    for e in range(n * n):
        put(tmp, e, COEFFICIENTS[16] * get(A4, e))
    add_powers(tmp, A, A2, A3, 12, n)
    for first in (8, 4, 0):
        product(out, A4, tmp, n)
        add_powers(out, A, A2, A3, first, n)
        out, tmp = tmp, out
    for _ in range(squarings):
        product(out, tmp, tmp, n)
        out, tmp = tmp, out
    return tmp


@njit(**INLINE)
def write_step(E, nx, m, nr, held, F, column, first):  # type: ignore[no-untyped-def]
    """Rows first.. of F, whose columns stand `column` apart: the next state from [r; x], from the
    exponential E of [x; r] or, where references run straight between samples, of [x; r; r']."""
    na = m + nx
    for i in range(nx):
        for j in range(nx):
            put(F, (m + j) * column + first + i, get(E, j * na + i))
        for j in range(nr):
            now = get(E, (nx + j) * na + i)
            if held:
                put(F, j * column + first + i, now)
            else:
                later = get(E, (nx + nr + j) * na + i)
                put(F, j * column + first + i, now - later)
                put(F, (nr + j) * column + first + i, later)


@njit(**OPTIONS)
def write_outputs(C, D, keep, n, m, unit, F, column, first):  # type: ignore[no-untyped-def]
    """Rows first.. of one lane's F (entries,): the outputs [D C] of [r; x]; the second half of
    references that run straight between samples has none."""
    for i in range(C.shape[0]):
        for j in range(m):
            F[j * column + first + i] = D[i, j] if j < D.shape[1] else 0.0
        for j in range(keep.size):
            F[(m + j) * column + first + i] = C[i, keep[j]] / (unit if keep[j] < n else 1.0)
