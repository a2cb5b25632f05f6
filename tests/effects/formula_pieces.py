"""Formulas that Python can evaluate too, and what is said of those that are refused."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

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
SLOWEST = 5.0
"""s of a processor: a thousand times what a formula takes."""
LONGEST_SENTENCE = 400


class OnKinkError(Exception):
    """The point cannot be compared."""


def sign(x: float) -> float:
    if abs(x) < KINK:
        raise OnKinkError
    return math.copysign(1.0, x)


BUILT_IN: dict[str, Callable[..., float]] = {"abs": abs, "min": min, "max": max, "sign": sign}
REFERENCES = {word: BUILT_IN.get(word) or vars(math)[word] for word in FUNCTIONS}
FRAMES = (
    "sin({})", "cos({})", "tan(sin({}))", "asin(0.9*tanh({}))", "acos(0.9*sin({}))", "atan({})",
    "exp(-abs({}))", "log(1 + abs({}))", "sqrt(0.5 + abs({}))", "abs({})", "sign({})", "tanh({})",
    "sinh(cos({}))", "cosh(sin({}))", "atan2({}, 2 + abs({}))", "min({}, {})", "max({}, {})",
    "{} + {}", "{}-{}", "({}-{})", "{}*{}", "({})*({})", "({}) / (2 + abs({}))", "-{}", "-({})",
    *(f"({{}})**{n}" for n in ("0", "1", "2", "3", "2.0")),
    *(f"(0.5 + abs({{}}))**{n}" for n in ("0.5", "-0.5", "1.5", "-2", "-3", "-2.5")),
)  # fmt: skip
"""Each function with arguments for which it is defined and not steep."""


def deepest(text: str) -> int:
    """Of its parentheses."""
    depths = [text[:k].count("(") - text[:k].count(")") for k in range(len(text))]
    return max(depths, default=0)


texts = st.recursive(
    st.sampled_from(sorted(NAMES)) | st.floats(0.01, 20.0).map("{:g}".format),
    lambda smaller: st.tuples(st.sampled_from(FRAMES), smaller, smaller).map(
        lambda parts: parts[0].format(*parts[1:])
    ),
    max_leaves=10,
).filter(
    lambda text: (
        deepest(text) <= min(NESTED_CALLS, DEEPEST)
        and text.count("**") <= NESTED_POWERS
        and len(text) <= LONGEST_TEXT
    )
)
points = st.fixed_dictionaries({name: st.floats(-2.0, 2.0) for name in NAMES})


def evaluated(text: str, at: Point) -> float:
    """By Python, whose syntax a formula has."""
    return float(eval(text, {"__builtins__": {}}, {**REFERENCES, **at}))


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
