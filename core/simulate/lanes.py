"""Exact discretisation and response of LANES small linear systems side by side.

The last axis of every array holds LANES independent systems (experiments of a cost, say), so
that one vector instruction advances all of them. Arrays are flat float64; a matrix (r, c) of
lanes stands row by row.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from core.arm.signatures import OPTIONS
from core.simulate.vector import LANES, add_squares, axpy, dot1, dot2, dot4

TAYLOR_DEGREE = 16
TAYLOR_RADIUS = 0.78
"""Norm up to which Taylor's polynomial of that degree is exact to rounding
(Higham, Functions of Matrices, 2008, table 10.2: theta_16 = 0.783)."""

MAX_SQUARINGS = 60
COEFFICIENTS = np.array([1.0 / float(np.prod(np.arange(1.0, k + 1.0))) for k in range(17)])


@njit(**OPTIONS)
def apply(A, a, rows, x, x0, n, w, w0, m, y, y0):  # type: ignore[no-untyped-def]
    """y = A [x; w] per lane: A (rows, n + m), x (n), w (m), y (rows), each LANES wide."""
    stride = (n + m) * LANES
    r = 0
    while r + 4 <= rows:
        dot4(A, a + r * stride, stride, x, x0, LANES, n, w, w0, m, y, y0 + r * LANES, LANES)
        r += 4
    if r + 2 <= rows:
        dot2(A, a + r * stride, stride, x, x0, LANES, n, w, w0, m, y, y0 + r * LANES, LANES)
        r += 2
    if r < rows:
        dot1(A, a + r * stride, stride, x, x0, LANES, n, w, w0, m, y, y0 + r * LANES, LANES)


@njit(**OPTIONS)
def product(out, A, B, n):  # type: ignore[no-untyped-def]
    """out = A B per lane; (n, n, LANES) each, out is neither A nor B."""
    row = n * LANES
    r = 0
    while r + 4 <= n:
        for j in range(n):
            dot4(A, r * row, row, B, j * LANES, row, n, B, 0, 0, out, r * row + j * LANES, row)
        r += 4
    if r + 2 <= n:
        for j in range(n):
            dot2(A, r * row, row, B, j * LANES, row, n, B, 0, 0, out, r * row + j * LANES, row)
        r += 2
    if r < n:
        for j in range(n):
            dot1(A, r * row, row, B, j * LANES, row, n, B, 0, 0, out, r * row + j * LANES, row)


@njit(**OPTIONS)
def largest_norm(A, n):  # type: ignore[no-untyped-def]
    """The largest row-sum norm of the lanes."""
    norm = 0.0
    sums = np.empty(LANES)
    for i in range(n):
        sums[:] = 0.0
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
    product(out, A4, tmp, n)
    add_powers(out, A, A2, A3, 8, n)
    product(tmp, A4, out, n)
    add_powers(tmp, A, A2, A3, 4, n)
    product(out, A4, tmp, n)
    add_powers(out, A, A2, A3, 0, n)
    for _ in range(squarings):
        product(tmp, out, out, n)
        out, tmp = tmp, out
    return out


@njit(**OPTIONS)
def advance_and_compare(F, nx, ny, m, x, start, stop, refs, nr, measured, weights, total):  # type: ignore[no-untyped-def]
    """Advances over samples start..stop-1 and adds sum weights (y - yhat)^2 to total (LANES).

    F (nx + ny, nx + m, LANES): the next state, then the outputs, from the state and m
    references (nr held, 2 nr where they run straight between samples). x (2 nx LANES): two
    buffers that take turns; sample t reads buffer t % 2. refs (N + 1, nr, LANES), measured and
    weights (N, ny, LANES).
    """
    wide = (nx + m) * LANES
    y = np.empty(ny * LANES)
    for t in range(start, stop):
        old = (t & 1) * nx * LANES
        new = nx * LANES - old
        apply(F, 0, nx, x, old, nx, refs, t * nr * LANES, m, x, new)
        apply(F, nx * wide, ny, x, old, nx, refs, t * nr * LANES, m, y, 0)
        for i in range(ny):
            at = (t * ny + i) * LANES
            add_squares(y, i * LANES, measured, at, weights, at, total, 0)


@njit(**OPTIONS)
def advance_and_store(F, nx, ny, m, x, start, stop, refs, nr, out):  # type: ignore[no-untyped-def]
    """As `advance_and_compare`, writing the outputs to out (N, ny, LANES)."""
    wide = (nx + m) * LANES
    for t in range(start, stop):
        old = (t & 1) * nx * LANES
        new = nx * LANES - old
        apply(F, 0, nx, x, old, nx, refs, t * nr * LANES, m, x, new)
        apply(F, nx * wide, ny, x, old, nx, refs, t * nr * LANES, m, out, t * ny * LANES)
