"""Own formulas: what is allowed means what it says."""

from __future__ import annotations

import random
import time

import numpy as np
import pytest
import sympy as sp
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from flexgui.core.effects.formula import (
    DEEPEST,
    LARGEST,
    LONGEST_TEXT,
    MOST_NODES,
    NESTED_CALLS,
    SMALLEST,
    parse_formula,
)
from flexgui.core.effects.real_functions import FUNCTIONS
from flexgui.core.errors import InputError
from tests.approved import approved
from tests.effects.formula_pieces import (
    LAST_DIGITS,
    NAMES,
    REFERENCES,
    ROUNDING,
    SLOWEST,
    OnKinkError,
    Point,
    evaluated,
    lambdified,
    points,
    sentence,
    texts,
)


@settings(max_examples=300)
@given(text=texts, at=points, modules=st.sampled_from(["numpy", "math"]))
def test_an_allowed_formula_is_worth_what_it_says(text: str, at: Point, modules: str) -> None:
    try:
        expected = evaluated(text, at)
    except OnKinkError:
        assume(False)
    try:
        expression = parse_formula(text, NAMES)
    except InputError as error:
        assert "in size; change its numbers" in str(error)  # a product of constants
        return
    assert expression.free_symbols <= set(NAMES.values())
    # Numbers on the way: sums and products of a few of these, cubed once for each power.
    scale = 20.0 * (1.0 + max(map(abs, at.values()))) * 100.0 ** (1 + text.count("**"))
    assert lambdified(expression, modules)(at) == pytest.approx(
        expected, rel=ROUNDING, abs=ROUNDING * scale
    )


SLOPE = 1e-5
"""Relative; central differences with a step of 1e-6 leave about 1e-9."""


@pytest.mark.parametrize("word", sorted(FUNCTIONS))
def test_slopes_of_a_function_are_its_differences(word: str) -> None:
    x, y = sp.symbols("x y", real=True)
    arity = next(iter(FUNCTIONS[word].nargs))
    expression = FUNCTIONS[word](*(x, y)[:arity])
    f = sp.lambdify((x, y), expression, modules="math")
    points = np.random.default_rng(4).uniform(0.1, 0.9, (20, 2))
    for symbol, (dx, dy) in ((x, (1e-6, 0.0)), (y, (0.0, 1e-6))):
        slope = sp.lambdify((x, y), expression.diff(symbol), modules="math")
        for a, b in points:
            differences = (f(a + dx, b + dy) - f(a - dx, b - dy)) / 2e-6
            assert float(slope(a, b)) == pytest.approx(differences, rel=SLOPE, abs=SLOPE)


@pytest.mark.parametrize("word", sorted(FUNCTIONS))
def test_a_function_is_the_same_in_python_numpy_and_folded(word: str) -> None:
    x, y = sp.symbols("x y", real=True)
    arity = next(iter(FUNCTIONS[word].nargs))
    call = f"{word}({', '.join(('x', 'y')[:arity])})"
    expression = parse_formula(call, {"x": x, "y": y})
    assert expression.is_real
    shown = sp.latex(expression**2)
    assert shown.endswith("^{2}")
    assert ("|" if word == "abs" else word) in shown
    a, b = np.random.default_rng(5).uniform(0.05, 0.95, (2, 30))
    fast = sp.lambdify((x, y), expression, modules="numpy")(a, b)
    slow = [sp.lambdify((x, y), expression, modules="math")(*ab) for ab in zip(a, b, strict=True)]
    pairs = [{x: sp.Float(p), y: sp.Float(q)} for p, q in zip(a, b, strict=True)]
    folded = [float(expression.xreplace(pair)) for pair in pairs]
    expected = [REFERENCES[word](*ab[:arity]) for ab in zip(a, b, strict=True)]
    for found in (fast, slow, folded):
        assert np.allclose(found, expected, rtol=LAST_DIGITS, atol=0.0)


def test_the_longest_formulas_are_read_derived_and_printed_quickly() -> None:
    """With SymPy's own functions, a few of these take minutes or for ever."""
    rng = random.Random(7)
    for _ in range(15):
        text = _largest(rng, 60, 0)
        start = time.thread_time()
        try:
            expression = parse_formula(text, NAMES)
        except InputError:
            continue
        for symbol in NAMES.values():
            sp.diff(expression, symbol)
        sp.lambdify(list(NAMES.values()), expression, cse=True)
        assert time.thread_time() - start < SLOWEST, text


def _largest(rng: random.Random, nodes: int, calls: int) -> str:
    if nodes <= 1:
        return rng.choice(("k", "vs", "fc", "0.5"))
    if calls < NESTED_CALLS and rng.random() < 0.4:
        word = rng.choice(("sinh", "cosh", "tanh", "tan", "abs", "sqrt", "log", "asin"))
        return f"{word}({_largest(rng, nodes - 1, calls + 1)})"
    left = rng.randint(1, nodes - 1)
    sides = _largest(rng, left, calls), _largest(rng, nodes - left, calls)
    return rng.choice("+-*/").join(sides)


def test_bounds_are_reached_but_not_passed() -> None:
    parse_formula("(" * DEEPEST + "k" + ")" * DEEPEST, NAMES)
    parse_formula("sin(" * NESTED_CALLS + "k" + ")" * NESTED_CALLS, NAMES)
    parse_formula("-" * (MOST_NODES - 1) + "k", NAMES)
    parse_formula("k" + " " * (LONGEST_TEXT - 3) + "*k", NAMES)
    parse_formula(f"{LARGEST:g}*k + {SMALLEST:g}", NAMES)
    parse_formula("k**8 + k**-8 + k**7.5", NAMES)
    assert "deep" in sentence("(" * (DEEPEST + 1) + "k" + ")" * (DEEPEST + 1))
    assert "deeper" in sentence("sin(" * (NESTED_CALLS + 1) + "k" + ")" * (NESTED_CALLS + 1))
    assert "terms" in sentence("-" * MOST_NODES + "k")
    assert "characters" in sentence("k" * (LONGEST_TEXT + 1))
    assert "out of range" in sentence("k*1e31")
    assert "whole or half" in sentence("k**8.5")


WRONG = (
    "-thet1*k", "tnah(k)", "q7", "k^2", "k(theta1)", "sin", "max(k)", "sin(k, k)", "k**vs",
    "log(-1)", "k/(fc - fc)", "sqrt(-2)*k", "", "k vs", "(k",
)  # fmt: skip


def test_the_sentence_names_the_piece_and_what_to_do() -> None:
    approved("formulas_refused.txt", "\n".join(f"{text}\n  {sentence(text)}" for text in WRONG))


def test_many_known_names_are_not_all_listed() -> None:
    many = {f"state_number_{i}": sp.Symbol(f"state_number_{i}") for i in range(100)}
    assert "and others" in sentence("zzz", many)
