"""Functions of an own formula beyond those of real numbers: tables, friction and hysteresis.

A table is a smooth curve through stated values at equally spaced knots (cubic convolution: R. Keys,
IEEE Transactions on Acoustics, Speech, and Signal Processing 29, 1981); each value acts between the
two knots on either side alone. Friction and hysteresis are the share u in [-1, 1] of a bristle that
follows a joint's direction (P. Dahl, 1968): u' = (v - |v| u) / s, with s the way over which it
turns, tiny for dry friction.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import sympy as sp

from ..effects.real_functions import FUNCTIONS
from ..errors import InputError

MOST_KNOTS = 16


class FormulaFunction(sp.Function):
    """A function that a formula may call, written with its name until the law is made."""

    is_real = True
    word: ClassVar[str]
    usage: ClassVar[str]

    def _latex(self, printer: object, exp: str | None = None) -> str:
        arguments = ", ".join(printer._print(a) for a in self.args)  # type: ignore[attr-defined]
        text = rf"\operatorname{{{self.word}}}\left({arguments}\right)"
        return text if exp is None else rf"{text}^{{{exp}}}"


class Table(FormulaFunction):
    """A curve through values; `expanded` writes it with plain functions."""

    def expanded(self, where: str) -> sp.Expr:
        """The curve; InputError, with `where` as the place, if its knots are wrong."""
        raise NotImplementedError


class Spline(Table):
    """spline(x, low, high, a1, ..., an): through a1 at low to an at high, constant beyond."""

    word, usage = "spline", "spline(theta1, -0.5, 0.5, a1, a2, a3)"
    nargs = tuple(range(6, 4 + MOST_KNOTS))

    def expanded(self, where: str) -> sp.Expr:
        x, low, high, *values = self.args
        if not (low.is_Number and high.is_Number and low < high):
            raise InputError(
                f"{where}: the first two numbers of a spline are its ends, the lower one first, as "
                f"in {self.usage}."
            )
        distance = (high - low) / (len(values) - 1)
        inside = FUNCTIONS["min"](FUNCTIONS["max"](x, low), high)
        # Straight on beyond each end, so that the curve goes through its last values.
        values = [2 * values[0] - values[1], *values, 2 * values[-1] - values[-2]]
        first = low - distance
        apart = [(inside - first) / distance - k for k in range(len(values))]
        return _curve(apart, values)


class Periodic(Table):
    """periodic(x, a1, ..., an): through a1 at x = 0 and the others at equal distances in 2 pi."""

    word, usage = "periodic", "periodic(theta1, a1, a2, a3, a4, a5, a6)"
    nargs = tuple(range(5, 2 + MOST_KNOTS))

    def expanded(self, where: str) -> sp.Expr:
        x, *values = self.args
        distance = 2.0 * sp.pi.evalf() / len(values)
        apart = [x - k * distance for k in range(len(values))]
        around = [FUNCTIONS["atan2"](FUNCTIONS["sin"](a), FUNCTIONS["cos"](a)) for a in apart]
        return _curve([a / distance for a in around], values)


def _curve(apart: Sequence[sp.Expr], values: Sequence[sp.Expr]) -> sp.Expr:
    """The sum of the values, each times the kernel at its distance, in knots."""
    return sp.Add(*(value * _kernel(d) for d, value in zip(apart, values, strict=True)))


def _kernel(d: sp.Expr) -> sp.Expr:
    """Keys' kernel, cubic within one knot and within two, zero beyond."""
    near, far = (FUNCTIONS["max"](k - FUNCTIONS["abs"](d), sp.Integer(0)) for k in (1, 2))
    return far**3 / 2 - far**2 / 2 + near**2 - 2 * near**3


class Bristle(FormulaFunction):
    """A share in [-1, 1] that follows the direction of the joint at its first argument."""


class Friction(Bristle):
    """friction(theta1): the direction of joint 1, at rest what holds it."""

    word, usage = "friction", "friction(theta1)"
    nargs = 1


class Hysteresis(Bristle):
    """hysteresis(theta1, s): the same with a way s over which it turns."""

    word, usage = "hysteresis", "hysteresis(theta1, s)"
    nargs = 2


FORMULA_FUNCTIONS: dict[str, type[sp.Function]] = {
    **FUNCTIONS,
    **{each.word: each for each in (Spline, Periodic, Friction, Hysteresis)},
}
"""All that a formula may call, by name."""


def with_expanded_tables(expression: sp.Expr, where: str) -> sp.Expr:
    """The expression with its tables written out; InputError where their knots are wrong."""
    return expression.replace(
        lambda part: isinstance(part, Table), lambda part: part.expanded(where)
    )


def bristles_in(expression: sp.Expr) -> list[Bristle]:
    """The different bristles of an expression."""
    return sorted(expression.atoms(Bristle), key=str)
