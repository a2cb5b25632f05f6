"""The linear algebra of one step for LANES arms, written out for their number of coordinates.

Loops over a handful of entries cost more than what they compute: with every entry a name of its own
the compiler keeps several sums under way at once. The methods are those of core.lanes.algebra.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

MOST_WRITTEN_OUT = 12
"""Coordinates up to which that holds: the text grows with their third power (for 12 coordinates as
long as the equations of such an arm), and more than a register file holds gains less."""

COMPILED = """@cfunc(types.void({kinds}), **OPTIONS)
def {name}({names}):
{body}"""
WRITTEN_OUT = """@statements
def {name}_statements({names}):
{body}"""

_Body = Callable[[int], list[str]]
"""The statements for a number of coordinates."""


def solver_functions(n: int) -> str:
    """The text of the functions of core.arm.compiled.WideSolvers for n coordinates."""
    functions: Sequence[tuple[str, tuple[str, ...], _Body, _Body]] = (
        ("factor", ("A", "growth"), factor, _factor_loop),
        ("substitute", ("A", "b"), substitute, _substitute_loop),
        ("solve_positive", ("A", "b"), solve_positive, _solve_positive_loop),
        ("multiply", ("A", "x", "out"), multiply, _multiply_loop),
        ("subtract", ("A", "x", "out"), subtract, _subtract_loop),
    )
    texts = []
    for name, names, written, loop in functions:
        lines = [f"{name}_statements({', '.join(names)})"]
        if n <= MOST_WRITTEN_OUT:
            texts.append(_function(WRITTEN_OUT, name, names, written(n)))
        else:
            lines = loop(n)
        texts.append(_function(COMPILED, name, names, lines))
    return "\n\n\n".join(texts)


def _function(form: str, name: str, names: tuple[str, ...], lines: Sequence[str]) -> str:
    kinds, body = ", ".join(["matrix"] * len(names)), "\n".join(f"    {line}" for line in lines)
    return form.format(kinds=kinds, name=name, names=", ".join(names), body=body)


def _less(first: str, products: Sequence[tuple[str, str]]) -> str:
    return first + "".join(f" - {a} * {b}" for a, b in products)


def factor(n: int) -> list[str]:
    """LU factors of A in place, the diagonal as reciprocals; `growth` (1, LANES) becomes the
    largest ratio of a diagonal entry to what was left of it, where that is larger."""
    lines = ["most = get(growth, 0)"]

    def left(i: int, k: int, terms: int) -> str:
        products = [(f"a_{i}_{j}", f"a_{j}_{k}") for j in range(terms)]
        return _less(f"get(A, {i * n + k})", products)

    for k in range(n):
        for i in range(k):
            lines += [f"a_{i}_{k} = {left(i, k, i)}", f"put(A, {i * n + k}, a_{i}_{k})"]
        for i in range(k):
            lines += [f"a_{k}_{i} = ({left(k, i, i)}) * a_{i}_{i}"]
            lines += [f"put(A, {k * n + i}, a_{k}_{i})"]
        lines += [f"a_{k}_{k} = 1.0 / ({left(k, k, k)})"]
        lines += [f"most = maximum(most, absolute(get(A, {k * n + k}) * a_{k}_{k}))"]
        lines += [f"put(A, {k * n + k}, a_{k}_{k})"]
    return [*lines, "put(growth, 0, most)"]


def substitute(n: int) -> list[str]:
    """Solves with the factors of `factor`; b becomes the solution."""
    lines = []
    for i in range(n):
        below = [(f"get(A, {i * n + j})", f"y_{j}") for j in range(i)]
        lines += [f"y_{i} = {_less(f'get(b, {i})', below)}"]
    for i in reversed(range(n)):
        above = [(f"get(A, {i * n + j})", f"x_{j}") for j in reversed(range(i + 1, n))]
        lines += [f"x_{i} = ({_less(f'y_{i}', above)}) * get(A, {i * n + i})"]
    return lines + [f"put(b, {i}, x_{i})" for i in range(n)]


def solve_positive(n: int) -> list[str]:
    """A = L D L' in place (L below, 1 / D on the diagonal) of a symmetric positive definite A, of
    which the lower part is read; b becomes the solution of A x = b."""
    lines = []
    for i in range(n):
        for j in range(i + 1):
            products = [(f"l_{i}_{k}", f"c_{j}_{k}") for k in range(j)]
            lines += [f"c_{i}_{j} = {_less(f'get(A, {i * n + j})', products)}"]
            if j < i:
                lines += [f"l_{i}_{j} = c_{i}_{j} * d_{j}", f"put(A, {i * n + j}, l_{i}_{j})"]
        lines += [f"d_{i} = 1.0 / c_{i}_{i}", f"put(A, {i * n + i}, d_{i})"]
        known = [(f"l_{i}_{k}", f"y_{k}") for k in range(i)]
        lines += [f"y_{i} = {_less(f'get(b, {i})', known)}"]
    for i in reversed(range(n)):
        known = [(f"l_{j}_{i}", f"x_{j}") for j in reversed(range(i + 1, n))]
        lines += [f"x_{i} = {_less(f'y_{i} * d_{i}', known)}"]
    return lines + [f"put(b, {i}, x_{i})" for i in range(n)]


def multiply(n: int) -> list[str]:
    """out = A x."""
    lines = [f"x_{j} = get(x, {j})" for j in range(n)]
    sums = (" + ".join(f"get(A, {i * n + j}) * x_{j}" for j in range(n)) for i in range(n))
    return lines + [f"put(out, {i}, {total})" for i, total in enumerate(sums)]


def subtract(n: int) -> list[str]:
    """out -= A x."""
    lines = [f"x_{j} = get(x, {j})" for j in range(n)]
    for i in range(n):
        products = [(f"get(A, {i * n + j})", f"x_{j}") for j in range(n)]
        lines.append(f"put(out, {i}, {_less(f'get(out, {i})', products)})")
    return lines


def _factor_loop(n: int) -> list[str]:
    return [f"algebra.factor(A, {n}, growth)"]


def _substitute_loop(n: int) -> list[str]:
    return [f"algebra.substitute(A, {n}, b)"]


def _solve_positive_loop(n: int) -> list[str]:
    return [f"algebra.factor_positive(A, {n})", f"algebra.substitute_positive(A, {n}, b)"]


def _multiply_loop(n: int) -> list[str]:
    return [f"algebra.multiply(out, A, x, {n}, {n})"]


def _subtract_loop(n: int) -> list[str]:
    return [f"algebra.add_product(out, -1.0, A, x, {n}, {n})"]
