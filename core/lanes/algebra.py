"""Dense linear algebra for the small matrices of one arm or of LANES side by side.

It allocates nothing. A vector of n numbers is an array (n,) of doubles or (n, LANES) of wide ones
(core.lanes.wide), a matrix one of rows * columns numbers, row by row.
"""

from __future__ import annotations

from ..compiler import njit
from ..lanes.functions import INLINE
from ..lanes.wide import get, put


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
def add_rows(out, scale, array, start):  # type: ignore[no-untyped-def]
    """out += scale array[start:]."""
    for i in range(out.shape[0]):
        put(out, i, get(out, i) + scale * get(array, start + i))


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
