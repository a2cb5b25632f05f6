"""From a force law to the text of a Python module that Numba compiles."""

from __future__ import annotations

from functools import lru_cache

import sympy as sp
from sympy.printing.pycode import PythonCodePrinter

from .. import __name__ as core
from ..forces.law import ForceLaw

_HEAD = '''"""A force law, written by core.forces.generate from its symbolic statement."""

from math import acos, asin, atan, atan2, cos, cosh, exp, log, sin, sinh, sqrt, tan, tanh

from numba import cfunc, types

pointer = types.CPointer(types.float64)
OPTIONS = {"cache": True, "nopython": True, "error_model": "numpy"}


@cfunc(types.void(pointer, pointer, pointer, pointer, pointer), **OPTIONS)
def element(x, v, w, e, out):
'''


_PLAIN_HEAD = '''"""A force law in plain Python, written by core.forces.generate."""

from numpy import arccos as acos, arcsin as asin, arctan as atan, arctan2 as atan2
from numpy import cos, cosh, exp, log, sin, sinh, sqrt, tan, tanh


def element(x, v, w, e, out):
'''


class _Printer(PythonCodePrinter):
    """Plain arithmetic that Numba knows."""

    def __init__(self, **known: str) -> None:
        """`known` are functions of formulas that have another name here."""
        super().__init__({
            "fully_qualified_modules": False, "allow_unknown_functions": False,
            "user_functions": known,
        })  # fmt: skip

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


_WIDE_HEAD = f'''"""A force law of LANES arms at once, written by {core}.forces.generate."""

from math import nan

from numba import carray, cfunc, types

from {core}.lanes.functions import (
    absolute, acos, asin, atan, atan2, cos, cosh, exp, get, log, maximum, minimum, power, put,
    select, sign, sin, sinh, spread, sqrt, step, tan, tanh,
)
from {core}.lanes.wide import LANES

pointer = types.CPointer(types.float64)
OPTIONS = {{"cache": True, "nopython": True, "error_model": "numpy", "fastmath": {{"contract"}}}}


@cfunc(types.void(pointer, pointer, pointer, pointer, pointer), **OPTIONS)
def element(x_, v_, w_, e_, out_):
    x, v = carray(x_, (@PORTS@, LANES)), carray(v_, (@PORTS@, LANES))
    w = carray(w_, (@STATES@, LANES))
    e, out = carray(e_, (@PARAMETERS@, LANES)), carray(out_, (@SIZE@, LANES))
'''


class _WidePrinter(_Printer):
    """The same with the functions of core.lanes; what chooses between cases is no branch."""

    printmethod = "_lanescode"  # which no function has: core.effects.real_functions say Python's

    def __init__(self) -> None:
        super().__init__(abs="absolute", min="minimum", max="maximum", sqrt="sqrt")

    def _print_Abs(self, expr: sp.Abs) -> str:  # noqa: N802
        return f"absolute({self._print(expr.args[0])})"

    def _print_sign(self, expr: sp.sign) -> str:
        return f"sign({self._print(expr.args[0])})"

    def _print_Heaviside(self, expr: sp.Heaviside) -> str:  # noqa: N802
        return f"step({self._print(expr.args[0])})"

    def _print_Piecewise(self, expr: sp.Piecewise) -> str:  # noqa: N802
        text = "nan"
        for value, condition in reversed(expr.args):
            one = self._print(value)
            text = one if condition == True else f"select({self._print(condition)}, {one}, {text})"  # noqa: E712
        return text

    def _folded(self, name: str, expr: sp.Expr) -> str:
        text = self._print(expr.args[0])
        for other in expr.args[1:]:
            text = f"{name}({text}, {self._print(other)})"
        return text

    def _print_Min(self, expr: sp.Min) -> str:  # noqa: N802
        return self._folded("minimum", expr)

    def _print_Max(self, expr: sp.Max) -> str:  # noqa: N802
        return self._folded("maximum", expr)

    def _print_Pow(self, expr: sp.Pow, rational: bool = False) -> str:  # noqa: N802
        base, exponent = expr.as_base_exp()
        inner = self.parenthesize(base, 100)
        if exponent.is_Integer and 2 <= abs(int(exponent)) <= 16:
            text = "*".join([inner] * abs(int(exponent)))
            return f"({text})" if exponent > 0 else f"(1.0/({text}))"
        if exponent == -1:
            return f"(1.0/{inner})"
        if abs(exponent) == sp.Rational(1, 2):
            root = f"sqrt({self._print(base)})"
            return root if exponent > 0 else f"(1.0/{root})"
        return f"power({self._print(base)}, {self._print(exponent)})"


def wide_module_text(law: ForceLaw) -> str:
    """The module of one law for LANES arms side by side."""
    head = _WIDE_HEAD
    sizes = {"PORTS": len(law.x), "STATES": len(law.states), "SIZE": law.size}
    for name, size in (sizes | {"PARAMETERS": len(law.parameters)}).items():
        head = head.replace(f"@{name}@", str(size))
    return _text(law, head, _WidePrinter(), "get({}, {})", "put(out, {}, {})")


def module_text(law: ForceLaw) -> str:
    """The module of one law."""
    return _text(law, _HEAD, _Printer(), "{}[{}]", "out[{}] = {}")


@lru_cache(128)
def plain_text(law: ForceLaw) -> str:
    """The module of one law that is not compiled."""
    return _text(law, _PLAIN_HEAD, _Printer(), "{}[{}]", "out[{}] = {}")


def _text(law: ForceLaw, head: str, printer: _Printer, read: str, write: str) -> str:
    outputs = [sp.Integer(0) + e for e in law.outputs()]
    shared, reduced = sp.cse(outputs, symbols=(sp.Symbol(f"c{i}") for i in range(10**6)))
    used = set().union(*[e.free_symbols for e in outputs])
    groups = (("x", law.x), ("v", law.v), ("w", law.states), ("e", law.parameters))
    lines = [
        f"{symbol} = {read.format(array, i)}"
        for array, symbols in groups
        for i, symbol in enumerate(_renamed(law, symbols))
        if symbols[i] in used
    ]
    new = dict(zip(_all(law), _renamed(law, _all(law)), strict=True))
    lines += [f"{name} = {printer.doprint(e.xreplace(new))}" for name, e in shared]
    lines += [write.format(i, printer.doprint(e.xreplace(new))) for i, e in enumerate(reduced)]
    return head + "".join(f"    {line}\n" for line in lines)


def _all(law: ForceLaw) -> tuple[sp.Symbol, ...]:
    return (*law.x, *law.v, *law.states, *law.parameters)


def _renamed(law: ForceLaw, symbols: tuple[sp.Symbol, ...]) -> list[sp.Symbol]:
    """Names that can neither be the arrays' nor a function's."""
    order = {s: i for i, s in enumerate(_all(law))}
    return [sp.Symbol(f"s{order[s]}", real=True) for s in symbols]
