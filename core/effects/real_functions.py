"""Real functions of real numbers, for formulas that a user writes.

SymPy's own functions ask whether their arguments are real by expanding complex parts, and sinh or
tanh of sums with twenty calls then takes minutes. These fold numbers, print for Python, NumPy and
LaTeX, and have plain derivatives.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, ClassVar

import sympy as sp

_LATEX = {"sqrt": r"\sqrt{%s}", "abs": r"\left|{%s}\right|"}


class RealFunction(sp.Function):
    """A function of real numbers; it is known to be real without a look at its arguments.

    It folds numbers with the floating-point function, prints as Python, NumPy and LaTeX, and its
    derivatives are such functions again; that of sign is 0 and abs, min, max have the mean slope
    at the kink.
    """

    is_real = True
    word: ClassVar[str]
    python: ClassVar[str]
    numpy: ClassVar[str]
    value: ClassVar[Callable[..., float]]
    slopes: ClassVar[Callable[..., tuple[sp.Expr, ...]]]

    @classmethod
    def eval(cls, *args: sp.Expr) -> sp.Expr | None:  # noqa: D102
        if not all(isinstance(a, sp.Number) for a in args):
            return None
        try:
            return sp.Float(cls.value(*(float(a) for a in args)))
        except (ValueError, OverflowError):
            return sp.nan

    def fdiff(self, argindex: int = 1) -> sp.Expr:  # noqa: D102
        return sp.S(type(self).slopes(*self.args)[argindex - 1])

    def _called(self, printer: Any, name: str) -> str:
        arguments = ", ".join(printer._print(a) for a in self.args)
        return f"{printer._module_format(name)}({arguments})"

    def _pythoncode(self, printer: Any) -> str:
        return self._called(printer, self.python)

    def _numpycode(self, printer: Any) -> str:
        return self._called(printer, self.numpy)

    def _latex(self, printer: Any, exp: str | None = None) -> str:
        arguments = ", ".join(printer._print(a) for a in self.args)
        plain = rf"\operatorname{{{self.word}}}\left({arguments}\right)"
        text = _LATEX[self.word] % arguments if self.word in _LATEX else plain
        return text if exp is None else rf"{text}^{{{exp}}}"


class _Sign(RealFunction):
    """Plain Python has no sign."""

    def _pythoncode(self, printer: Any) -> str:
        x = printer._print(self.args[0])
        return f"((1.0 if ({x}) > 0.0 else 0.0) - (1.0 if ({x}) < 0.0 else 0.0))"


def _function(
    word: str,
    value: Callable[..., float],
    numpy: str,
    slopes: Callable[..., tuple[sp.Expr, ...]],
    base: type[RealFunction] = RealFunction,
    arity: int = 1,
) -> tuple[str, type[RealFunction]]:
    home = "math." if value.__module__ == "math" else ""
    body = {
        "__module__": __name__,
        "word": word,
        "nargs": arity,
        "python": f"{home}{word}",
        "numpy": f"numpy.{numpy}",
        "value": staticmethod(value),
        "slopes": staticmethod(slopes),
    }
    return word, type(word, (base,), body)


def _sign(x: float) -> float:
    return math.copysign(1.0, x) if x else 0.0


def _step(a: sp.Expr, b: sp.Expr) -> sp.Expr:
    """1 where a > b, 0 where a < b, 1/2 where they are equal."""
    return (1 + _f("sign", a - b)) / 2


def _f(word: str, *args: sp.Expr) -> sp.Expr:
    return FUNCTIONS[word](*args)


FUNCTIONS: dict[str, type[RealFunction]] = dict(
    [
        _function("sin", math.sin, "sin", lambda x: (_f("cos", x),)),
        _function("cos", math.cos, "cos", lambda x: (-_f("sin", x),)),
        _function("tan", math.tan, "tan", lambda x: (1 + _f("tan", x) ** 2,)),
        _function("asin", math.asin, "arcsin", lambda x: (1 / _f("sqrt", 1 - x**2),)),
        _function("acos", math.acos, "arccos", lambda x: (-1 / _f("sqrt", 1 - x**2),)),
        _function("atan", math.atan, "arctan", lambda x: (1 / (1 + x**2),)),
        _function(
            "atan2",
            math.atan2,
            "arctan2",
            lambda y, x: (x / (x**2 + y**2), -y / (x**2 + y**2)),
            arity=2,
        ),
        _function("exp", math.exp, "exp", lambda x: (_f("exp", x),)),
        _function("log", math.log, "log", lambda x: (1 / x,)),
        _function("sqrt", math.sqrt, "sqrt", lambda x: (1 / (2 * _f("sqrt", x)),)),
        _function("abs", abs, "abs", lambda x: (_f("sign", x),)),
        _function("sign", _sign, "sign", lambda x: (sp.S.Zero,), base=_Sign),
        _function("tanh", math.tanh, "tanh", lambda x: (1 - _f("tanh", x) ** 2,)),
        _function("sinh", math.sinh, "sinh", lambda x: (_f("cosh", x),)),
        _function("cosh", math.cosh, "cosh", lambda x: (_f("sinh", x),)),
        _function("min", min, "minimum", lambda a, b: (_step(b, a), _step(a, b)), arity=2),
        _function("max", max, "maximum", lambda a, b: (_step(a, b), _step(b, a)), arity=2),
    ]
)
"""What a formula may call, by name."""
