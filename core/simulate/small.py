"""Dense linear algebra for the small matrices of an arm, compiled and without allocation."""

from __future__ import annotations

from numba import njit

from core.arm.signatures import OPTIONS


@njit(**OPTIONS)
def factor(A, pivots):  # type: ignore[no-untyped-def]
    """LU factors of A (n, n) with partial pivoting, in place; pivots (n,) int64."""
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
        for i in range(k + 1, n):
            A[i, k] *= inverse
            for j in range(k + 1, n):
                A[i, j] -= A[i, k] * A[k, j]


@njit(**OPTIONS)
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
        b[i] = total / A[i, i]


@njit(**OPTIONS)
def add_product(out, scale, A, x):  # type: ignore[no-untyped-def]
    """out += scale A x."""
    for i in range(A.shape[0]):
        total = 0.0
        for j in range(A.shape[1]):
            total += A[i, j] * x[j]
        out[i] += scale * total


@njit(**OPTIONS)
def multiply(out, A, x):  # type: ignore[no-untyped-def]
    """out = A x."""
    for i in range(A.shape[0]):
        total = 0.0
        for j in range(A.shape[1]):
            total += A[i, j] * x[j]
        out[i] = total


@njit(**OPTIONS)
def combine(out, x, scale, y):  # type: ignore[no-untyped-def]
    """out = x + scale y."""
    for i in range(out.size):
        out[i] = x[i] + scale * y[i]


@njit(**OPTIONS)
def advance(x, a, k1, b, k2):  # type: ignore[no-untyped-def]
    """x += a k1 + b k2."""
    for i in range(x.size):
        x[i] += a * k1[i] + b * k2[i]


@njit(**OPTIONS)
def add_matrices(out, A, B):  # type: ignore[no-untyped-def]
    """out = A + B."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = A[i, j] + B[i, j]
