"""The linear algebra of one step for LANES arms, written out for their number of coordinates.

Loops over a handful of entries cost more than what they compute: with every entry a name of its own
the compiler keeps several sums under way at once.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..arm.printing import written_out


def solver_functions(n: int) -> list[str]:
    """The text of the functions of core.arm.compiled.WideArm.solvers for n coordinates."""
    return [
        written_out("factor", "A, growth", factor(n)),
        written_out("substitute", "A, b", substitute(n)),
        written_out("solve_positive", "A, b", solve_positive(n)),
        written_out("multiply", "A, x, out", multiply(n)),
        written_out("subtract", "A, x, out", subtract(n)),
    ]


def _less(first: str, products: Sequence[tuple[str, str]]) -> str:
    return first + "".join(f" - {a} * {b}" for a, b in products)


def factor(n: int) -> list[str]:
    """LU factors of A in place, the diagonal as reciprocals; no rows are exchanged.

    The matrices of a step are an inertia plus what damps and holds, so their pivots stay near the
    diagonal they had. `growth` (1, LANES) becomes the largest ratio of a diagonal entry to what
    was left of it, where that is larger: a caller takes shorter steps where it is too large.
    """
    lines = ["most = growth[0]"]

    def left(i: int, k: int, terms: int) -> str:
        products = [(f"a_{i}_{j}", f"a_{j}_{k}") for j in range(terms)]
        return _less(f"A[{i * n + k}]", products)

    for k in range(n):
        for i in range(k):
            lines += [f"a_{i}_{k} = {left(i, k, i)}", f"A[{i * n + k}] = a_{i}_{k}"]
        for i in range(k):
            lines += [f"a_{k}_{i} = ({left(k, i, i)}) * a_{i}_{i}"]
            lines += [f"A[{k * n + i}] = a_{k}_{i}"]
        lines += [f"a_{k}_{k} = 1.0 / ({left(k, k, k)})"]
        lines += [f"most = maximum(most, absolute(A[{k * n + k}] * a_{k}_{k}))"]
        lines += [f"A[{k * n + k}] = a_{k}_{k}"]
    return [*lines, "growth[0] = most"]


def substitute(n: int) -> list[str]:
    """Solve with the factors of `factor`; b becomes the solution."""
    lines = []
    for i in range(n):
        below = [(f"A[{i * n + j}]", f"y_{j}") for j in range(i)]
        lines += [f"y_{i} = {_less(f'b[{i}]', below)}"]
    for i in reversed(range(n)):
        above = [(f"A[{i * n + j}]", f"x_{j}") for j in reversed(range(i + 1, n))]
        lines += [f"x_{i} = ({_less(f'y_{i}', above)}) * A[{i * n + i}]"]
    return lines + [f"b[{i}] = x_{i}" for i in range(n)]


def solve_positive(n: int) -> list[str]:
    """A = L D L' in place (L below, 1 / D on the diagonal) of a symmetric positive definite A, of
    which the lower part is read; b becomes the solution of A x = b."""
    lines = []
    for i in range(n):
        for j in range(i + 1):
            products = [(f"l_{i}_{k}", f"c_{j}_{k}") for k in range(j)]
            lines += [f"c_{i}_{j} = {_less(f'A[{i * n + j}]', products)}"]
            if j < i:
                lines += [f"l_{i}_{j} = c_{i}_{j} * d_{j}", f"A[{i * n + j}] = l_{i}_{j}"]
        lines += [f"d_{i} = 1.0 / c_{i}_{i}", f"A[{i * n + i}] = d_{i}"]
        terms = [(f"l_{i}_{k}", f"y_{k}") for k in range(i)]
        lines += [f"y_{i} = {_less(f'b[{i}]', terms)}"]
    for i in reversed(range(n)):
        terms = [(f"l_{j}_{i}", f"x_{j}") for j in reversed(range(i + 1, n))]
        lines += [f"x_{i} = {_less(f'y_{i} * d_{i}', terms)}"]
    return lines + [f"b[{i}] = x_{i}" for i in range(n)]


def multiply(n: int) -> list[str]:
    """out = A x."""
    lines = [f"x_{j} = x[{j}]" for j in range(n)]
    sums = (" + ".join(f"A[{i * n + j}] * x_{j}" for j in range(n)) for i in range(n))
    return lines + [f"out[{i}] = {total}" for i, total in enumerate(sums)]


def subtract(n: int) -> list[str]:
    """out -= A x."""
    lines = [f"x_{j} = x[{j}]" for j in range(n)]
    for i in range(n):
        products = [(f"A[{i * n + j}]", f"x_{j}") for j in range(n)]
        lines.append(f"out[{i}] = {_less(f'out[{i}]', products)}")
    return lines
