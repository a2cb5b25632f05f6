"""From a force law to the text of a Python module that Numba compiles."""

from __future__ import annotations

import sympy as sp
from sympy.printing.pycode import PythonCodePrinter

from core.forces.law import ForceLaw

_HEAD = '''"""A force law, written by core.forces.generate from its symbolic statement."""

from math import acos, asin, atan, atan2, cos, cosh, exp, log, sin, sinh, sqrt, tan, tanh

from numba import cfunc, types

pointer = types.CPointer(types.float64)
OPTIONS = {"cache": True, "nopython": True, "error_model": "numpy"}


@cfunc(types.void(pointer, pointer, pointer, pointer, pointer), **OPTIONS)
def element(x, v, w, e, out):
'''


class _Printer(PythonCodePrinter):
    """Plain arithmetic that Numba knows."""

    def __init__(self) -> None:
        super().__init__({"fully_qualified_modules": False, "allow_unknown_functions": False})

    def _print_sign(self, expr: sp.sign) -> str:
        inner = self._print(expr.args[0])
        return f"((1.0 if ({inner}) > 0.0 else 0.0) - (1.0 if ({inner}) < 0.0 else 0.0))"

    def _print_Heaviside(self, expr: sp.Heaviside) -> str:  # noqa: N802
        return f"(1.0 if ({self._print(expr.args[0])}) > 0.0 else 0.0)"

    def _print_DiracDelta(self, expr: sp.DiracDelta) -> str:  # noqa: N802
        return "0.0"  # the slope of a jump: the step's implicit part may leave it out

    def _print_Min(self, expr: sp.Min) -> str:  # noqa: N802
        return f"min({', '.join(self._print(a) for a in expr.args)})"

    def _print_Max(self, expr: sp.Max) -> str:  # noqa: N802
        return f"max({', '.join(self._print(a) for a in expr.args)})"

    def _print_Rational(self, expr: sp.Rational) -> str:  # noqa: N802
        return f"({expr.p}/{expr.q})"


def module_text(law: ForceLaw) -> str:
    """The module of one law."""
    printer = _Printer()
    outputs = [sp.Integer(0) + e for e in law.outputs()]
    shared, reduced = sp.cse(outputs, symbols=(sp.Symbol(f"c{i}") for i in range(10**6)))
    used = set().union(*[e.free_symbols for e in outputs])
    groups = (("x", law.x), ("v", law.v), ("w", law.states), ("e", law.parameters))
    lines = [
        f"{symbol} = {array}[{i}]"
        for array, symbols in groups
        for i, symbol in enumerate(_renamed(law, symbols))
        if symbols[i] in used
    ]
    new = dict(zip(_all(law), _renamed(law, _all(law)), strict=True))
    lines += [f"{name} = {printer.doprint(e.subs(new))}" for name, e in shared]
    lines += [f"out[{i}] = {printer.doprint(e.subs(new))}" for i, e in enumerate(reduced)]
    return _HEAD + "".join(f"    {line}\n" for line in lines)


def _all(law: ForceLaw) -> tuple[sp.Symbol, ...]:
    return (*law.x, *law.v, *law.states, *law.parameters)


def _renamed(law: ForceLaw, symbols: tuple[sp.Symbol, ...]) -> list[sp.Symbol]:
    """Names that can neither be the arrays' nor a function's."""
    order = {s: i for i, s in enumerate(_all(law))}
    return [sp.Symbol(f"s{order[s]}", real=True) for s in symbols]
