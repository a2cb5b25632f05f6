"""Statements of a generated module, from expressions of SymPy."""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp
from sympy.printing.pycode import PythonCodePrinter

_FUNCTION = """

@statements
def {name}_statements({names}):
    {body}


@cfunc(types.void({kinds}), **OPTIONS)
def {name}({names}):
    {name}_statements({names})
"""


def written_out(name: str, names: str, lines: Sequence[str]) -> str:
    """A compiled function of arrays of numbers, with the names of its arguments, from assignments
    that are written straight as instructions."""
    kinds, body = ", ".join(["numbers"] * len(names.split(", "))), "\n    ".join(lines)
    return _FUNCTION.format(name=name, names=names, kinds=kinds, body=body)


class _Printer(PythonCodePrinter):
    """Plain arithmetic; small powers as products, which Numba compiles best."""

    def __init__(self) -> None:
        super().__init__({"fully_qualified_modules": False, "allow_unknown_functions": False})

    def _print_Pow(self, expr: sp.Pow, rational: bool = False) -> str:  # noqa: N802
        base, power = expr.as_base_exp()
        if power.is_Integer and 2 <= int(power) <= 16:
            factor = self.parenthesize(base, 100)
            return "(" + "*".join([factor] * int(power)) + ")"
        return str(super()._print_Pow(expr, rational=rational))

    def _print_Rational(self, expr: sp.Rational) -> str:  # noqa: N802
        return f"({expr.p}/{expr.q})"


def code(expression: sp.Expr) -> str:
    """An expression as Python writes it."""
    return str(_Printer().doprint(expression))


def free_symbols(expressions: Sequence[sp.Expr]) -> set[sp.Basic]:
    """All symbols that the expressions contain."""
    return set().union(*[e.free_symbols for e in expressions]) if expressions else set()


class Statements:
    """Grows line by line; each value gets a name of its own with one prefix.

    `lines`: what they are appended to, where they do not stand alone.
    """

    def __init__(self, prefix: str, lines: list[str] | None = None) -> None:
        self.prefix = prefix
        self.lines = [] if lines is None else lines
        self._count = 0

    def let(self, expression: sp.Expr) -> sp.Expr:
        """A name that has the value from here on; what is a number or a name stays as it is."""
        expression = sp.sympify(expression, strict=True)  # a text would be evaluated
        if expression.is_Symbol or expression.is_Number:
            return expression
        name = sp.Symbol(f"{self.prefix}{self._count}", real=True)
        self._count += 1
        self.lines.append(f"{name} = {code(expression)}")
        return name

    def shared(self, outputs: Sequence[sp.Expr]) -> list[sp.Expr]:
        """Names of the outputs; what several of them contain is computed once."""
        names = (sp.Symbol(f"{self.prefix}c{self._count + i}") for i in range(10**6))
        subexpressions, reduced = sp.cse(list(outputs), symbols=names, optimizations=None)
        self.lines += [f"{name} = {code(e)}" for name, e in subexpressions]
        self._count += len(subexpressions)
        return [self.let(e) for e in reduced]
