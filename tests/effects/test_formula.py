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
from tests.effects.formula_pieces import (
    LAST_DIGITS,
    NAMES,
    REFERENCES,
    ROUNDING,
    SLOPE,
    SLOWEST,
    OnKinkError,
    Piece,
    Point,
    lambdified,
    pieces,
    points,
    sentence,
)


@settings(max_examples=300)
@given(piece=pieces, at=points, modules=st.sampled_from(["numpy", "math"]))
def test_an_allowed_formula_is_worth_what_it_says(piece: Piece, at: Point, modules: str) -> None:
    try:
        expected = piece.value(at)
    except OnKinkError:
        assume(False)
    try:
        expression = parse_formula(piece.text, NAMES)
    except InputError as error:
        assert "in size; change its numbers" in str(error)  # a product of constants
        return
    assert expression.free_symbols <= set(NAMES.values())
    found = lambdified(expression, modules)(at)
    assert found == pytest.approx(expected, rel=ROUNDING, abs=ROUNDING * _scale(piece, at))


def _scale(piece: Piece, at: Point) -> float:
    """Numbers on the way: sums and products of a few of these, cubed once for each power."""
    return 20.0 * (1.0 + max(map(abs, at.values()))) * 100.0 ** (1 + piece.powers)


@pytest.mark.parametrize("word", sorted(FUNCTIONS))
def test_slopes_of_a_function_are_its_differences(word: str) -> None:
    x, y = sp.symbols("x y", real=True)
    arity = next(iter(FUNCTIONS[word].nargs))
    expression = FUNCTIONS[word](*(x, y)[:arity])
    rng = np.random.default_rng(4)
    for a, b in rng.uniform(0.1, 0.9, (20, 2)):
        for symbol, step in ((x, (1e-6, 0.0)), (y, (0.0, 1e-6))):
            f = sp.lambdify((x, y), expression, modules="math")
            slope = sp.lambdify((x, y), expression.diff(symbol), modules="math")(a, b)
            up, down = f(a + step[0], b + step[1]), f(a - step[0], b - step[1])
            assert float(slope) == pytest.approx((up - down) / 2e-6, rel=SLOPE, abs=SLOPE)


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


def test_a_formula_vanishes_where_the_parameter_that_scales_it_does() -> None:
    friction = parse_formula("-fc*tanh(dtheta1/vs) - k*abs(dtheta1)*dtheta1", NAMES)
    assert friction.xreplace({NAMES["fc"]: sp.Integer(0), NAMES["k"]: sp.Integer(0)}) == 0


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


@pytest.mark.parametrize(
    ("text", "piece"),
    [
        ("-thet1*k", "did you mean 'theta1'"),
        ("tnah(k)", "did you mean 'tanh'"),
        ("q7", "use theta1, dtheta1, delta2, fc, vs, k"),
        ("k^2", "write ** for a power"),
        ("k(theta1)", "write * for a product"),
        ("sin", "write its argument in parentheses"),
        ("max(k)", "takes 2 plain arguments"),
        ("sin(k, k)", "takes 1 plain argument;"),
        ("k**vs", "exp(b*log(a))"),
        ("log(-1)", "'log(-1)'"),
        ("k/(fc - fc)", "divides by zero"),
        ("sqrt(-2)*k", "'sqrt(-2)'"),
        ("", "empty"),
        ("k vs", "operator"),
        ("(k", "parentheses"),
    ],
)
def test_the_sentence_names_the_piece_and_what_to_do(text: str, piece: str) -> None:
    assert piece in sentence(text)


def test_many_known_names_are_not_all_listed() -> None:
    many = {f"state_number_{i}": sp.Symbol(f"state_number_{i}") for i in range(100)}
    assert "and others" in sentence("zzz", many)


def test_where_stands_at_the_start_of_the_sentence() -> None:
    with pytest.raises(InputError, match=r"^formula of 'drag': "):
        parse_formula("k.real", NAMES, "formula of 'drag'")
