"""Dense linear algebra for the small matrices of an arm, compiled and without allocation."""

from __future__ import annotations

from numba import njit

from core.arm.signatures import OPTIONS

INLINE = {"forceinline": True, **OPTIONS}
"""Passing an array costs more than adding a few numbers, so callers take these functions in."""


@njit(**INLINE)
def factor(A, pivots):  # type: ignore[no-untyped-def]
    """LU factors of A (n, n) with partial pivoting, in place; pivots (n,) int64.

    The diagonal holds the reciprocals of U's: dividing takes four times as long as multiplying.
    """
    n = A.shape[0]
    for k in range(n):
        best, at = abs(A[k, k]), k
        for i in range(k + 1, n):
            if abs(A[i, k]) > best:
                best, at = abs(A[i, k]), i
        pivots[k] = at
        if at != k:
            for j in range(n):
                A[k, j], A[at, j] = A[at, j], A[k, j]
        inverse = 1.0 / A[k, k]
        A[k, k] = inverse
        for i in range(k + 1, n):
            A[i, k] *= inverse
            for j in range(k + 1, n):
                A[i, j] -= A[i, k] * A[k, j]


@njit(**INLINE)
def substitute(A, pivots, b):  # type: ignore[no-untyped-def]
    """Solves with the factors of `factor`; b (n,) becomes the solution."""
    n = A.shape[0]
    for k in range(n):
        at = pivots[k]
        if at != k:
            b[k], b[at] = b[at], b[k]
    for i in range(1, n):
        total = b[i]
        for j in range(i):
            total -= A[i, j] * b[j]
        b[i] = total
    for i in range(n - 1, -1, -1):
        total = b[i]
        for j in range(i + 1, n):
            total -= A[i, j] * b[j]
        b[i] = total * A[i, i]


@njit(**INLINE)
def factor_positive(A):  # type: ignore[no-untyped-def]
    """A = L D L' of a symmetric positive definite A (n, n): L below, 1 / D on the diagonal.

    Only the lower triangle is read and written; no pivoting is needed.
    """
    n = A.shape[0]
    for k in range(n):
        inverse = 1.0 / A[k, k]
        A[k, k] = inverse
        for i in range(n - 1, k, -1):
            ratio = A[i, k] * inverse
            for j in range(k + 1, i + 1):
                A[i, j] -= ratio * A[j, k]
            A[i, k] = ratio


@njit(**INLINE)
def substitute_positive(A, b):  # type: ignore[no-untyped-def]
    """Solves with the factors of `factor_positive`; b (n,) becomes the solution."""
    n = A.shape[0]
    for k in range(n):
        for i in range(k + 1, n):
            b[i] -= A[i, k] * b[k]
    for i in range(n - 1, -1, -1):
        total = b[i] * A[i, i]
        for j in range(i + 1, n):
            total -= A[j, i] * b[j]
        b[i] = total


@njit(**INLINE)
def add_product(out, scale, A, x):  # type: ignore[no-untyped-def]
    """out += scale A x."""
    for i in range(A.shape[0]):
        total = 0.0
        for j in range(A.shape[1]):
            total += A[i, j] * x[j]
        out[i] += scale * total


@njit(**INLINE)
def multiply(out, A, x):  # type: ignore[no-untyped-def]
    """out = A x."""
    for i in range(A.shape[0]):
        total = 0.0
        for j in range(A.shape[1]):
            total += A[i, j] * x[j]
        out[i] = total


@njit(**INLINE)
def combine(out, x, scale, y):  # type: ignore[no-untyped-def]
    """out = x + scale y."""
    for i in range(out.size):
        out[i] = x[i] + scale * y[i]


@njit(**INLINE)
def advance(x, a, k1, b, k2):  # type: ignore[no-untyped-def]
    """x += a k1 + b k2."""
    for i in range(x.size):
        x[i] += a * k1[i] + b * k2[i]


@njit(**INLINE)
def add_matrices(out, A, B):  # type: ignore[no-untyped-def]
    """out = A + B."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = A[i, j] + B[i, j]


@njit(**INLINE)
def write_row(A, k, start, x):  # type: ignore[no-untyped-def]
    """A[k, start:] = x; a slice would take Numba a second to compile, with its messages."""
    for i in range(x.size):
        A[k, start + i] = x[i]


@njit(**INLINE)
def read_row(x, A, k):  # type: ignore[no-untyped-def]
    """x = A[k]."""
    for i in range(x.size):
        x[i] = A[k, i]
