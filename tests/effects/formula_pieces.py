"""Formulas made of pieces whose meaning is known, and what is said of those that are refused."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import pytest
import sympy as sp
from hypothesis import strategies as st

from flexgui.core.effects import formula
from flexgui.core.effects.formula import (
    DEEPEST,
    LONGEST_TEXT,
    NESTED_CALLS,
    NESTED_POWERS,
    parse_formula,
)
from flexgui.core.effects.real_functions import FUNCTIONS
from flexgui.core.errors import InputError

NAMES = {n: sp.Symbol(n, real=True) for n in ("theta1", "dtheta1", "delta2", "fc", "vs", "k")}
Point = Mapping[str, float]

ROUNDING = 1e-9
"""Of the largest number on the way: a text's order of sums is not SymPy's, and 1e-16 of rounding
passes through slopes of up to about 1e5."""
KINK = 1e-6
"""Arguments of sign nearer to zero than this are left out: rounding decides their sign there."""
LAST_DIGITS = 1e-14
"""NumPy's functions differ from the C library's in the last digit."""
SLOPE = 1e-5
"""Relative; central differences with a step of 1e-6 leave about 1e-9."""
SLOWEST = 5.0
"""s of a processor: a thousand times what a formula takes."""
LONGEST_SENTENCE = 400


class OnKinkError(Exception):
    """The point cannot be compared."""


@dataclass(frozen=True)
class Piece:
    """A text, what it should be worth, and how tightly its outermost operation binds."""

    text: str
    value: Callable[[Point], float]
    binds: int = 9
    calls: int = 0
    powers: int = 0

    def within(self, at_least: int) -> str:
        return self.text if self.binds >= at_least else f"({self.text})"


def sign(x: float) -> float:
    if abs(x) < KINK:
        raise OnKinkError
    return math.copysign(1.0, x)


SAFE: dict[str, tuple[str, Callable[[float], float], int]] = {
    "sin": ("sin({})", math.sin, 1),
    "cos": ("cos({})", math.cos, 1),
    "tan": ("tan(sin({}))", lambda u: math.tan(math.sin(u)), 2),
    "asin": ("asin(0.9*tanh({}))", lambda u: math.asin(0.9 * math.tanh(u)), 2),
    "acos": ("acos(0.9*sin({}))", lambda u: math.acos(0.9 * math.sin(u)), 2),
    "atan": ("atan({})", math.atan, 1),
    "exp": ("exp(-abs({}))", lambda u: math.exp(-abs(u)), 2),
    "log": ("log(1 + abs({}))", lambda u: math.log(1 + abs(u)), 2),
    "sqrt": ("sqrt(0.5 + abs({}))", lambda u: math.sqrt(0.5 + abs(u)), 2),
    "abs": ("abs({})", abs, 1),
    "sign": ("sign({})", sign, 1),
    "tanh": ("tanh({})", math.tanh, 1),
    "sinh": ("sinh(cos({}))", lambda u: math.sinh(math.cos(u)), 2),
    "cosh": ("cosh(sin({}))", lambda u: math.cosh(math.sin(u)), 2),
}
"""Each function with arguments for which it is defined and not steep."""
PAIRS: dict[str, Callable[[float, float], float]] = {
    "atan2": lambda a, b: math.atan2(a, 2.0 + abs(b)),
    "min": min,
    "max": max,
}
SUMS: dict[str, tuple[int, int, int, Callable[[float, float], float]]] = {
    " + ": (1, 1, 2, lambda a, b: a + b),
    "-": (1, 1, 2, lambda a, b: a - b),
    "*": (2, 2, 3, lambda a, b: a * b),
    " / ": (2, 2, 9, lambda a, b: a / (2.0 + abs(b))),
}
"""How the operator binds, and its left and right operand must."""
BUILT_IN: dict[str, Callable[..., float]] = {
    "abs": abs, "min": min, "max": max, "sign": lambda u: math.copysign(1.0, u)
}  # fmt: skip
REFERENCES = {word: BUILT_IN.get(word) or vars(math)[word] for word in FUNCTIONS}
POWERS = ("0", "1", "2", "3", "2.0")
HALVES = ("0.5", "-0.5", "1.5", "-2", "-3", "-2.5")


def _binary(parts: tuple[Piece, str, Piece]) -> Piece:
    a, operator, b = parts
    own, left, right, combine = SUMS[operator]
    second = f"(2 + abs({b.text}))" if operator == " / " else b.within(right)
    inner = b.calls + (operator == " / ")
    return Piece(
        a.within(left) + operator + second,
        lambda at: combine(a.value(at), b.value(at)),
        own,
        max(a.calls, inner),
        max(a.powers, b.powers),
    )


def _called(parts: tuple[str, Piece]) -> Piece:
    (text, function, depth), a = SAFE[parts[0]], parts[1]
    return Piece(
        text.format(a.text), lambda at: function(a.value(at)), 9, a.calls + depth, a.powers
    )


def _paired(parts: tuple[str, Piece, Piece]) -> Piece:
    name, a, b = parts
    second = f"2 + abs({b.text})" if name == "atan2" else b.text
    return Piece(
        f"{name}({a.text}, {second})",
        lambda at: PAIRS[name](a.value(at), b.value(at)),
        9,
        1 + max(a.calls, b.calls + (name == "atan2")),
        max(a.powers, b.powers),
    )


def _powered(parts: tuple[Piece, str]) -> Piece:
    a, n = parts
    if n in POWERS:
        return Piece(
            f"{a.within(9)}**{n}", lambda at: a.value(at) ** float(n), 4, a.calls, a.powers + 1
        )
    return Piece(
        f"(0.5 + abs({a.text}))**{n}",
        lambda at: (0.5 + abs(a.value(at))) ** float(n),
        4,
        a.calls + 1,
        a.powers + 1,
    )


def _negated(a: Piece) -> Piece:
    return Piece(f"-{a.within(3)}", lambda at: -a.value(at), 3, a.calls, a.powers)


def _constant(value: float) -> Piece:
    return Piece(f"{value:g}", lambda at: float(f"{value:g}"))


def _named(name: str) -> Piece:
    return Piece(name, lambda at: at[name])


def _grown(smaller: st.SearchStrategy[Piece]) -> st.SearchStrategy[Piece]:
    return st.one_of(
        st.tuples(smaller, st.sampled_from(sorted(SUMS)), smaller).map(_binary),
        st.tuples(st.sampled_from(sorted(SAFE)), smaller).map(_called),
        st.tuples(st.sampled_from(sorted(PAIRS)), smaller, smaller).map(_paired),
        st.tuples(smaller, st.sampled_from(POWERS + HALVES)).map(_powered),
        smaller.map(_negated),
    )


leaves = st.one_of(
    st.sampled_from(sorted(NAMES)).map(_named),
    st.floats(0.01, 20.0).map(_constant),
)
pieces = st.recursive(leaves, _grown, max_leaves=10).filter(
    lambda p: (
        p.calls <= NESTED_CALLS
        and p.powers <= NESTED_POWERS
        and len(p.text) <= LONGEST_TEXT
        and p.text.count("(") <= DEEPEST
    )
)
points = st.fixed_dictionaries({name: st.floats(-2.0, 2.0) for name in NAMES})


def lambdified(expression: sp.Expr, modules: str = "numpy") -> Callable[[Point], float]:
    function = sp.lambdify(list(NAMES.values()), expression, modules=modules)
    return lambda at: float(function(*(at[name] for name in NAMES)))


def sentence(text: str, names: Mapping[str, sp.Symbol] = NAMES) -> str:
    """What is said about a formula that is refused."""
    with pytest.raises(InputError) as caught:
        parse_formula(text, names)
    said = str(caught.value)
    assert said.startswith(formula.WHERE)
    assert said.endswith(".")
    assert "\n" not in said
    assert said.isprintable()
    assert len(said) < LONGEST_SENTENCE
    return said
