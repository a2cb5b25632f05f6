"""Compiled closed-loop matrices of LANES systems, ready to be exponentiated.

E(kappa) x' = A(kappa) x + B r with x = [q, q', s] and the drive's feedback closed, (6-11) of the
paper. E is never inverted in the model's statement; here its inertia is factored once per posture,
for all lanes at once.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from core.arm.signatures import OPTIONS
from core.lanes.functions import INLINE
from core.simulate.lanes import aligned
from core.simulate.vector import LANES, scale, subtract


@njit(**OPTIONS)
def work_arrays(n, ns, nr):  # type: ignore[no-untyped-def]
    """Work arrays of `place`: for one lane M (n n,), K, D, f, right; for all lanes M and the rows
    of q'' and s' over [q, q', s, r], flat."""
    columns = 2 * n + ns + nr
    return (
        np.empty(n * n), np.empty(n * n), np.empty(n * n), np.empty(n), np.zeros(n),
        aligned(n * n * LANES), aligned((n + ns) * columns * LANES),
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
        at = i * columns * LANES + lane
        for j in range(n):
            inertia[(i * n + j) * LANES + lane] = M[i * n + j]
            rows[at + j * LANES] = -K[i * n + j] - (P[s, i, j] if driven else 0.0)
            rows[at + (n + j) * LANES] = -D[i * n + j] - (V[s, i, j] if driven else 0.0)
        for j in range(ns):
            rows[at + (2 * n + j) * LANES] = -S[s, i, j] if driven else 0.0
        for j in range(nr):
            rows[at + (2 * n + ns + j) * LANES] = R[s, i, j] if driven else 0.0
    for i in range(ns):
        at = (n + i) * columns * LANES + lane
        for j in range(n):
            rows[at + j * LANES] = Fq[s, i, j]
            rows[at + (n + j) * LANES] = Fv[s, i, j]
        for j in range(ns):
            rows[at + (2 * n + j) * LANES] = Fs[s, i, j]
        for j in range(nr):
            rows[at + (2 * n + ns + j) * LANES] = Fr[s, i, j]


@njit(**INLINE)
def reciprocal(x, at):  # type: ignore[no-untyped-def]
    """x[at + lane] = 1 / x[at + lane]."""
    for lane in range(LANES):
        x[at + lane] = 1.0 / x[at + lane]


@njit(**OPTIONS)
def solve(M, n, rows, columns):  # type: ignore[no-untyped-def]
    """The first n of `rows` (.., columns, LANES) become M^-1 times them; M (n, n, LANES) is
    overwritten by L, below, and 1 / D of M = L D L'."""
    ratio = aligned(LANES)
    for k in range(n):
        reciprocal(M, (k * n + k) * LANES)
        for i in range(n - 1, k, -1):
            at = (i * n + k) * LANES
            scale(ratio, 0, M, at, M, (k * n + k) * LANES)
            for j in range(k + 1, i + 1):
                subtract(M, (i * n + j) * LANES, ratio, 0, M, (j * n + k) * LANES)
            scale(M, at, M, at, M, (k * n + k) * LANES)
    wide = columns * LANES
    for i in range(n):
        for k in range(i):
            for j in range(0, wide, LANES):
                subtract(rows, i * wide + j, M, (i * n + k) * LANES, rows, k * wide + j)
    for i in range(n - 1, -1, -1):
        for j in range(0, wide, LANES):
            scale(rows, i * wide + j, M, (i * n + i) * LANES, rows, i * wide + j)
        for k in range(i + 1, n):
            for j in range(0, wide, LANES):
                subtract(rows, i * wide + j, M, (k * n + i) * LANES, rows, k * wide + j)


@njit(**OPTIONS)
def balance(rows, n, columns):  # type: ignore[no-untyped-def]
    """A power of two that brings q to the size of q', so that few squarings are needed."""
    largest = 1.0
    for i in range(n):
        for j in range(n):
            largest = max(largest, abs(rows[(i * columns + j) * LANES]))
    return 2.0 ** np.round(0.5 * np.log2(largest))


@njit(**OPTIONS)
def augment(rows, n, ns, nr, keep, h, held, unit, aug):  # type: ignore[no-untyped-def]
    """aug (na, na, LANES) = h [A B; 0 0] of the states that matter, with q in its unit.

    Where references run straight between samples, r' = their change per sample comes below.
    """
    nx, columns = keep.size, 2 * n + ns + nr
    na = nx + (nr if held else 2 * nr)
    for e in range(na * na * LANES):
        aug[e] = 0.0
    one = aligned(LANES)
    for i in range(nx):
        si = unit if keep[i] < n else 1.0
        if keep[i] < n:
            for j in range(nx):
                if keep[j] == keep[i] + n:
                    for lane in range(LANES):
                        aug[(j * na + i) * LANES + lane] = h[lane] * si
            continue
        at = (keep[i] - n) * columns * LANES
        for j in range(nx + nr):
            source = keep[j] if j < nx else 2 * n + ns + j - nx
            sj = unit if source < n else 1.0
            for lane in range(LANES):
                one[lane] = h[lane] * (si / sj)
            scale(aug, (j * na + i) * LANES, one, 0, rows, at + source * LANES)
    if not held:
        for j in range(nr):
            for lane in range(LANES):
                aug[((nx + nr + j) * na + nx + j) * LANES + lane] = 1.0
