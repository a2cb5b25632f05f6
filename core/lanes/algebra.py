"""Dense linear algebra for the small matrices of one arm or of LANES side by side.

It allocates nothing. A vector of n numbers is an array (n,) of doubles or (n, LANES) of wide ones
(core.lanes.wide), a matrix one of rows * columns numbers, row by row.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from ..lanes.functions import INLINE
from ..lanes.wide import absolute, get, maximum, put


@njit(**{**INLINE, "_nrt": True})
def zeros(like, count):  # type: ignore[no-untyped-def]
    """As many numbers of the kind that the array `like` holds."""
    return np.zeros((count,) + like.shape[1:])


@njit(**INLINE)
def factor_exchanging(A, n, pivots):  # type: ignore[no-untyped-def]
    """LU factors of one A (n, n) with partial pivoting, in place; pivots (n,), rows as doubles.

    The diagonal holds the reciprocals of U's: dividing takes four times as long as multiplying.
    """
    for k in range(n):
        best, at = absolute(get(A, k * n + k)), k
        for i in range(k + 1, n):
            size = absolute(get(A, i * n + k))
            if size > best:
                best, at = size, i
        put(pivots, k, at)
        if at != k:
            for j in range(n):
                swap(A, k * n + j, at * n + j)
        inverse = 1.0 / get(A, k * n + k)
        put(A, k * n + k, inverse)
        for i in range(k + 1, n):
            ratio = get(A, i * n + k) * inverse
            put(A, i * n + k, ratio)
            for j in range(k + 1, n):
                put(A, i * n + j, get(A, i * n + j) - ratio * get(A, k * n + j))


@njit(**INLINE)
def swap(x, i, j):  # type: ignore[no-untyped-def]
    """Two entries take each other's place."""
    first = get(x, i)
    put(x, i, get(x, j))
    put(x, j, first)


@njit(**INLINE)
def exchange(pivots, b):  # type: ignore[no-untyped-def]
    """The rows of b (n,) in the order of the factors of `factor_exchanging`."""
    for k in range(b.shape[0]):
        at = int(get(pivots, k))
        if at != k:
            swap(b, k, at)


@njit(**INLINE)
def factor(A, n, growth):  # type: ignore[no-untyped-def]
    """LU factors of A (n, n) in place, the diagonal as reciprocals; no rows are exchanged.

    The matrices of a step are an inertia plus what damps and holds, so their pivots stay near the
    diagonal they had. `growth` (1,) becomes the largest ratio of a diagonal entry to what was
    left of it, where that is larger: a caller repeats with exchanges where it is too large.
    """
    for k in range(n):
        for i in range(k):
            total = get(A, i * n + k)
            for j in range(i):
                total -= get(A, i * n + j) * get(A, j * n + k)
            put(A, i * n + k, total)
        for i in range(k + 1):
            total = get(A, k * n + i)
            for j in range(i):
                total -= get(A, k * n + j) * get(A, j * n + i)
            if i < k:
                put(A, k * n + i, total * get(A, i * n + i))
            else:
                inverse = 1.0 / total
                ratio = absolute(get(A, k * n + k) * inverse)
                put(growth, 0, maximum(get(growth, 0), ratio))
                put(A, k * n + k, inverse)


@njit(**INLINE)
def substitute(A, n, b):  # type: ignore[no-untyped-def]
    """Solves with LU factors; b (n,) becomes the solution."""
    for i in range(1, n):
        total = get(b, i)
        for j in range(i):
            total -= get(A, i * n + j) * get(b, j)
        put(b, i, total)
    for i in range(n - 1, -1, -1):
        total = get(b, i)
        for j in range(i + 1, n):
            total -= get(A, i * n + j) * get(b, j)
        put(b, i, total * get(A, i * n + i))


@njit(**INLINE)
def factor_positive(A, n):  # type: ignore[no-untyped-def]
    """A = L D L' of a symmetric positive definite A (n, n): L below, 1 / D on the diagonal.

    Only the lower triangle is read and written; no pivoting is needed.
    """
    for k in range(n):
        inverse = 1.0 / get(A, k * n + k)
        put(A, k * n + k, inverse)
        for i in range(n - 1, k, -1):
            ratio = get(A, i * n + k) * inverse
            for j in range(k + 1, i + 1):
                put(A, i * n + j, get(A, i * n + j) - ratio * get(A, j * n + k))
            put(A, i * n + k, ratio)


@njit(**INLINE)
def substitute_positive(A, n, b):  # type: ignore[no-untyped-def]
    """Solves with the factors of `factor_positive`; b (n,) becomes the solution."""
    for k in range(n):
        solved = get(b, k)
        for i in range(k + 1, n):
            put(b, i, get(b, i) - get(A, i * n + k) * solved)
    for i in range(n - 1, -1, -1):
        total = get(b, i) * get(A, i * n + i)
        for j in range(i + 1, n):
            total -= get(A, j * n + i) * get(b, j)
        put(b, i, total)


@njit(**INLINE)
def dot(A, row, x):  # type: ignore[no-untyped-def]
    """A row of A (.., n) times x (n,)."""
    total, n = 0.0, x.shape[0]
    for j in range(n):
        total += get(A, row * n + j) * get(x, j)
    return total


@njit(**INLINE)
def add_product(out, scale, A, x):  # type: ignore[no-untyped-def]
    """out += scale A x."""
    for i in range(out.shape[0]):
        put(out, i, get(out, i) + scale * dot(A, i, x))


@njit(**INLINE)
def multiply(out, A, x):  # type: ignore[no-untyped-def]
    """out = A x."""
    for i in range(out.shape[0]):
        put(out, i, dot(A, i, x))


@njit(**INLINE)
def combine(out, x, scale, y):  # type: ignore[no-untyped-def]
    """out = x + scale y, vectors or matrices of one shape."""
    for i in range(out.shape[0]):
        put(out, i, get(x, i) + scale * get(y, i))


@njit(**INLINE)
def copy(out, x):  # type: ignore[no-untyped-def]
    """out = x."""
    for i in range(out.shape[0]):
        put(out, i, get(x, i))


@njit(**INLINE)
def advance(x, a, k1, b, k2):  # type: ignore[no-untyped-def]
    """x += a k1 + b k2."""
    for i in range(x.shape[0]):
        put(x, i, get(x, i) + (a * get(k1, i) + b * get(k2, i)))


@njit(**INLINE)
def write(out, start, x):  # type: ignore[no-untyped-def]
    """out[start:] = x; a slice would take Numba a second to compile, with its messages."""
    for i in range(x.shape[0]):
        put(out, start + i, get(x, i))


@njit(**INLINE)
def read(x, array, start):  # type: ignore[no-untyped-def]
    """x = array[start:]."""
    for i in range(x.shape[0]):
        put(x, i, get(array, start + i))


# What each step needs most is written out for the number n of coordinates of LANES arms side by
# side (core.arm.solvers), and comes as `solvers` = (n, *functions); for one arm, with `solvers` =
# (n,), loops are as quick, and rows are exchanged. `note` (n,) is what `factor_square` says:
# pivots, or the growth in the lanes.


@njit(**INLINE)
def factor_square(solvers, A, note):  # type: ignore[no-untyped-def]
    """LU factors of A (n, n) in place."""
    if A.ndim == 1:
        factor_exchanging(A, solvers[0], note)
    else:
        solvers[1](A, note)


@njit(**INLINE)
def substitute_square(solvers, A, note, b):  # type: ignore[no-untyped-def]
    """Solves with the factors of `factor_square`; b (n,) becomes the solution."""
    if A.ndim == 1:
        exchange(note, b)
        substitute(A, b.shape[0], b)
    else:
        solvers[2](A, b)


@njit(**INLINE)
def solve_positive(solvers, A, b):  # type: ignore[no-untyped-def]
    """A = L D L' in place as `factor_positive` leaves it; b (n,) becomes the solution."""
    if A.ndim == 1:
        factor_positive(A, b.shape[0])
        substitute_positive(A, b.shape[0], b)
    else:
        solvers[3](A, b)


@njit(**INLINE)
def multiply_square(solvers, out, A, x):  # type: ignore[no-untyped-def]
    """out = A x."""
    if A.ndim == 1:
        multiply(out, A, x)
    else:
        solvers[4](A, x, out)


@njit(**INLINE)
def subtract_square(solvers, out, A, x):  # type: ignore[no-untyped-def]
    """out -= A x."""
    if A.ndim == 1:
        add_product(out, -1.0, A, x)
    else:
        solvers[5](A, x, out)
