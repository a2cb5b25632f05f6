"""Compiled closed-loop matrices of LANES systems, ready to be exponentiated.

E(kappa) x' = A(kappa) x + B r with x = [q, q', s] and the drive's feedback closed, (6-11) of the
paper. E is never inverted in the model's statement; here its inertia is factored once per posture,
for all lanes at once.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from core.arm.signatures import OPTIONS
from core.lanes.algebra import factor_positive
from core.lanes.functions import INLINE
from core.lanes.wide import get, put
from core.simulate.lanes import aligned, exponential


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
