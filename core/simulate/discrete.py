"""Exact discretisation of LANES closed-loop systems side by side.

E(kappa) x' = A(kappa) x + B r with x = [q, q', s] and the drive's feedback closed, (6-11) of the
paper. E is never inverted in the model's statement; here its inertia is factored once per posture,
for all lanes at once.

Arrays of wide numbers (entries, LANES) hold LANES independent systems (experiments of a cost, say),
so that one vector instruction advances all of them. A matrix (r, c) of the discrete systems stands
column by column, so that a product with a vector reads it from end to end.
"""

from __future__ import annotations

import numpy as np

from ..arm.signatures import OPTIONS, cube
from ..compiler import njit, types
from ..lanes.algebra import factor_positive
from ..lanes.functions import INLINE
from ..lanes.rows import apply
from ..lanes.wide import LANES, absolute, get, lane, maximum, put

LAWS = types.Tuple((cube,) * 8)
"""R, P, V, S, Fs, Fq, Fv, Fr of core.drives.law.DriveLaw; the systems come first."""

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
def write_step(E, nx, m, nr, hold, F, column, first):  # type: ignore[no-untyped-def]
    """Rows first.. of F, whose columns stand `column` apart: the next state from [r; x], from the
    exponential E of [x; r] or, where references run straight between samples, of [x; r; r']."""
    na = m + nx
    for i in range(nx):
        for j in range(nx):
            put(F, (m + j) * column + first + i, get(E, j * na + i))
        for j in range(nr):
            now = get(E, (nx + j) * na + i)
            if hold:
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


@njit(**OPTIONS)
def work_arrays(n, ns, nr):  # type: ignore[no-untyped-def]
    """Work arrays of `place`: for one lane M (n n,), K, D, f, right; for all lanes M and the rows
    of q'' and s' over [q, q', s, r]."""
    columns = 2 * n + ns + nr
    return (
        np.empty(n * n), np.empty(n * n), np.empty(n * n), np.empty(n), np.zeros(n),
        aligned(n * n), aligned((n + ns) * columns),
    )  # fmt: skip


@njit(**OPTIONS)
def place(dynamics, linear, p, q, laws, s, lane, work):  # type: ignore[no-untyped-def]
    """Writes the inertia, and the rows of M q'' and s', of one lane at the straight arm in q.

    The laws of system s give M q'' = [-K - P, -D - V, -S, R] [q; q'; s; r].
    """
    R, P, V, S, Fs, Fq, Fv, Fr = laws
    M, K, D, f, zero, inertia, rows = work
    n, ns, nr = q.size, S.shape[2], R.shape[2]
    columns = 2 * n + ns + nr
    dynamics(q, zero, p, M, f)
    linear(q, p, K, D)
    for i in range(n):
        driven = i < R.shape[1]
        at = i * columns
        for j in range(n):
            inertia[i * n + j, lane] = M[i * n + j]
            rows[at + j, lane] = -K[i * n + j] - (P[s, i, j] if driven else 0.0)
            rows[at + n + j, lane] = -D[i * n + j] - (V[s, i, j] if driven else 0.0)
        for j in range(ns):
            rows[at + 2 * n + j, lane] = -S[s, i, j] if driven else 0.0
        for j in range(nr):
            rows[at + 2 * n + ns + j, lane] = R[s, i, j] if driven else 0.0
    for i in range(ns):
        at = (n + i) * columns
        for j in range(n):
            rows[at + j, lane] = Fq[s, i, j]
            rows[at + n + j, lane] = Fv[s, i, j]
        for j in range(ns):
            rows[at + 2 * n + j, lane] = Fs[s, i, j]
        for j in range(nr):
            rows[at + 2 * n + ns + j, lane] = Fr[s, i, j]


@njit(**INLINE)
def subtract_row(rows, columns, i, factor, k):  # type: ignore[no-untyped-def]
    """Row i less a factor times row k."""
    for j in range(columns):
        at = i * columns + j
        put(rows, at, get(rows, at) - factor * get(rows, k * columns + j))


@njit(**INLINE)
def solve(M, n, rows, columns):  # type: ignore[no-untyped-def]
    """The first n of `rows` (.., columns) become M^-1 times them; M (n, n) its factors."""
    factor_positive(M, n)
    for i in range(n):
        for k in range(i):
            subtract_row(rows, columns, i, get(M, i * n + k), k)
    for i in range(n - 1, -1, -1):
        for j in range(i * columns, (i + 1) * columns):
            put(rows, j, get(rows, j) * get(M, i * n + i))
        for k in range(i + 1, n):
            subtract_row(rows, columns, i, get(M, k * n + i), k)


@njit(**OPTIONS)
def balance(rows, n, columns):  # type: ignore[no-untyped-def]
    """A power of two that brings q to the size of q', so that few squarings are needed."""
    largest = 1.0
    for i in range(n):
        for j in range(n):
            largest = max(largest, abs(rows[i * columns + j, 0]))
    return 2.0 ** np.round(0.5 * np.log2(largest))


@njit(**INLINE)
def augment(rows, n, columns, nr, keep, h, unit, aug, na):  # type: ignore[no-untyped-def]
    """aug (na, na) = h [A B; 0 0] of the states that matter, with q in its unit.

    Where references run straight between samples, r' = their change per sample comes below.
    """
    nx, step = keep.size, get(h, 0)
    for e in range(na * na):
        put(aug, e, 0.0)
    for i in range(nx):
        if keep[i] < n:
            for j in range(nx):
                if keep[j] == keep[i] + n:
                    put(aug, j * na + i, step * unit)
            continue
        for j in range(nx + nr):
            source = keep[j] if j < nx else columns - nr + j - nx
            scale = 1.0 / unit if source < n else 1.0
            put(aug, j * na + i, step * scale * get(rows, (keep[i] - n) * columns + source))
    for j in range(na - nx - nr):
        put(aug, (nx + nr + j) * na + nx + j, 1.0)


@njit(**OPTIONS)
def discretised(space, n, nr, columns, keep, h, unit, aug, na, work):  # type: ignore[no-untyped-def]
    """exp(h [A B; 0 0]) of what `place` wrote, and the unit of q in the states: the one given, or
    where that is zero a good one. h (1, LANES) in s."""
    solve(space[5], n, space[6], columns)
    if unit == 0.0:
        unit = balance(space[6], n, columns)
    augment(space[6], n, columns, nr, keep, h, unit, aug, na)
    return exponential(aug, na, work), unit


@njit(**OPTIONS)
def start(x0, keep, n, unit, x):  # type: ignore[no-untyped-def]
    """x (nx,): the states that matter of x0, with q in its unit."""
    for i in range(keep.size):
        x[i] = x0[keep[i]] * (unit if keep[i] < n else 1.0)
