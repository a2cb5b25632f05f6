"""Own formulas: what is allowed means what it says, and nothing else is ever run."""

from __future__ import annotations

import ast
import builtins
import keyword
import math
import os
import random
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from core.effects import formula
from core.effects.formula import (
    DEEPEST,
    FUNCTIONS,
    LARGEST,
    LONGEST_NAME,
    LONGEST_TEXT,
    MOST_NODES,
    NESTED_CALLS,
    NESTED_POWERS,
    SMALLEST,
    parameter_names,
    parse_formula,
)
from core.errors import InputError

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
"""s for one formula: a thousand times what it takes, for a busy machine."""
LONGEST_SENTENCE = 400
HOSTILE = 1000


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
        start = time.perf_counter()
        try:
            expression = parse_formula(text, NAMES)
        except InputError:
            continue
        for symbol in NAMES.values():
            sp.diff(expression, symbol)
        sp.lambdify(list(NAMES.values()), expression, cse=True)
        assert time.perf_counter() - start < SLOWEST, text


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


def test_new_names_are_parameters_in_order_of_appearance() -> None:
    text = "c2*sin(b*theta1) + a*tanh(dtheta1/vs) - c2*exp(-b)"
    assert parameter_names(text, ["theta1", "dtheta1"]) == ("c2", "b", "a", "vs")
    assert parameter_names("-2*theta1", {"theta1"}) == ()


@pytest.mark.parametrize("name", ["_a", "__class__", "lambda", "None", "b" * (LONGEST_NAME + 1)])
def test_a_bad_name_is_no_parameter(name: str) -> None:
    with pytest.raises(InputError, match=r"name|too long"):
        parameter_names(f"2*{name}", [])


def test_where_stands_at_the_start_of_the_sentence() -> None:
    with pytest.raises(InputError, match=r"^formula of 'drag': "):
        parse_formula("k.real", NAMES, "formula of 'drag'")


# Hostile formulas ------------------------------------------------------------------------------

CALLS = ("open('{f}', 'w')", "os.system('touch {f}')", "eval('1')", "exec('x=1')", "print(k)")
LOOKALIKES = "аеорсхукѕіјԁΑΒΕ１２３＋＊（）٣۴²½ªℯ𝐤𝑘ﬁ‿−∗⁄"  # noqa: RUF001
KEYWORDS = tuple(keyword.kwlist)

Make = Callable[[random.Random, str], str]


def _any(rng: random.Random) -> str:
    return rng.choice(("k", "theta1", "2.5", "sin(k)", "fc*vs", "(k + 1)"))


def _attribute(rng: random.Random, canary: str) -> str:
    words = ("real", "diff", "subs", "evalf", "__class__", "__init__", "func", "args", "name")
    return _any(rng) + "".join(f".{rng.choice(words)}" for _ in range(rng.randint(1, 4)))


def _dunder(rng: random.Random, canary: str) -> str:
    word = rng.choice(("import", "builtins", "class", "globals", "subclasses", "debug", "name"))
    return rng.choice(("__{}__", "__{}__(k)", "k + __{}__", "_{}", "__{}")).format(word)


def _tower(rng: random.Random, canary: str) -> str:
    return "**".join(str(rng.randint(2, 99)) for _ in range(rng.randint(3, 30)))


def _huge_power(rng: random.Random, canary: str) -> str:
    exponent = rng.choice(("9", "1e9", "99999999", "-9", "1e-3", "0.3", "(2*9)", "(k)", "--2"))
    return f"{_any(rng)}**{exponent}" + rng.choice(("", "**2", "*k"))


def _folded(rng: random.Random, canary: str) -> str:
    text = rng.choice(("exp({})", "cosh({})", "{}**8**1", "exp(exp({}))", "exp(exp(exp({})))"))
    return text.format(rng.randint(100, 10**9))


def _deep(rng: random.Random, canary: str) -> str:
    depth = rng.choice((DEEPEST + 1, 50, 100, 240, 1000, 10**4, 10**5))
    left, right = rng.choice((("(", ")"), ("sin(", ")"), ("-(", ")"), ("[", "]"), ("(", "")))
    return left * depth + "k" + right * depth


def _nested_calls(rng: random.Random, canary: str) -> str:
    words = [rng.choice(("sin", "exp", "tanh", "cosh")) for _ in range(rng.randint(7, 20))]
    return "".join(f"{w}(" for w in words) + "k" + ")" * len(words)


def _chain(rng: random.Random, canary: str) -> str:
    return rng.choice("-~+") * rng.choice((MOST_NODES, 300, 10**4)) + "k"


def _long_number(rng: random.Random, canary: str) -> str:
    digits = "".join(rng.choice("123456789") for _ in range(rng.choice((40, 200, 450, 5000))))
    return rng.choice(("{}", "k*{}", "1/{}", "1e{}", "k-{}.5")).format(digits)


def _odd_number(rng: random.Random, canary: str) -> str:
    odd = "1e999 -1e999 1e-999 1j 2.5J 1_000 0x1F 0b11 0o17 007 1e 1.2.3 1..real ... inf nan 3k"
    return rng.choice(("{}", "k*{}", "sin({})")).format(rng.choice(odd.split()))


def _character(rng: random.Random, canary: str) -> str:
    text = _any(rng) + "*k"
    at = rng.randint(1, len(text) - 1)
    return (
        text[:at]
        + rng.choice("\x00\n\r\t\f\x0b\x1b\u2028\u202e\ufeff\ud800;#\\`$?!&|~%@:")
        + text[at:]
    )


def _lookalike(rng: random.Random, canary: str) -> str:
    return f"{_any(rng)}*{rng.choice(LOOKALIKES)}"


def _arguments(rng: random.Random, canary: str) -> str:
    inside = rng.choice(("x=k", "*k", "**k", "k, evaluate=0", "", "k, k, k, k", "*(k, k)", "k, *k"))
    return f"{rng.choice(sorted(FUNCTIONS))}({inside})"


def _keyword(rng: random.Random, canary: str) -> str:
    return rng.choice(("{}", "k + {}", "({} k)", "k {} vs", "{}(k)")).format(rng.choice(KEYWORDS))


def _called_things(rng: random.Random, canary: str) -> str:
    things = ("k(1)", "2(k)", "sin(k)(k)", "(sin)(k)(k)", "eval(k)", "exec(k)", "open(k)", "vs()")
    more = ("sympify(k)", "getattr(k, k)", "compile(k)", "input()", "breakpoint()", "exit()")
    return rng.choice(("{}", "k*{}", "exp({})")).format(rng.choice(things + more))


def _tuples(rng: random.Random, canary: str) -> str:
    return rng.choice(("(k, {})", "k, {}", "()", "({},)", "(k)*({}, 2)")).format(_any(rng))


def _operator(rng: random.Random, canary: str) -> str:
    return rng.choice(("//", "%", "@", "<<", ">>", "&", "|", "==", "<", ":=", "=", "!=")).join(
        (_any(rng), _any(rng))
    )


def _zero(rng: random.Random, canary: str) -> str:
    zero = rng.choice(("0", "0.0", "(k - k)", "(0*k)", "sin(0)", "(vs - 1.0*vs)", "log(1)"))
    return rng.choice(("1/{}", "k/{}", "{}**-1", "log({})", "0/{}", "{0}/{0}")).format(zero)


def _imaginary(rng: random.Random, canary: str) -> str:
    return rng.choice(("sqrt(-{})", "log(-{})", "asin(1{})", "acos(-1{})", "(-{})**0.5")).format(
        rng.randint(1, 99)
    )


def _code(rng: random.Random, canary: str) -> str:
    call = rng.choice(CALLS).format(f=canary)
    frames = (
        "{}", "k + {}", "sin({})", "(lambda: {})()", "[{} for i in (1,)]", "{{{}}}", "(k := {})",
        "f'{{{}}}'", "k if {} else vs", "k[{}]", "k and {}", "not {}", "(yield {})", "await {}",
        "{{i: {} for i in (1,)}}", "k < {}", "'{}'", 'b"{}"', "__import__('os') or {}", "k\n{}",
    )  # fmt: skip
    return rng.choice(frames).format(call)


def _import(rng: random.Random, canary: str) -> str:
    frames = ("import os", "from os import system", "__import__('os').system('touch {}')")
    return rng.choice(frames).format(canary)


def _subscript(rng: random.Random, canary: str) -> str:
    return rng.choice(("k[0]", "k[k]", "[k][0]", "(k, vs)[0]", "{'a': k}['a']", "k[::2]", "[k]"))


def _boolean(rng: random.Random, canary: str) -> str:
    frames = ("True", "None*k", "k and vs", "k or {}", "not k", "k is {}", "k in {}", "k < {}")
    return rng.choice((*frames, "k if vs else {}", "k if vs < 1 else {}")).format(_any(rng))


def _broken(rng: random.Random, canary: str) -> str:
    return rng.choice(
        ("k +", "* k", "k {}", "k * * {}", "(k", "k)", ")k(", "", " ", "k,,{}")
    ).format(_any(rng))


KINDS: tuple[Make, ...] = (
    _attribute, _dunder, _tower, _huge_power, _folded, _deep, _nested_calls, _chain, _long_number,
    _odd_number, _character, _lookalike, _arguments, _keyword, _called_things, _tuples, _operator,
    _zero, _imaginary, _code, _import, _subscript, _boolean, _broken,
)  # fmt: skip


@contextmanager
def guarded() -> Iterator[list[str]]:
    """What is run that must not be; `compile` may only build a syntax tree."""
    monkeypatch = pytest.MonkeyPatch()
    ran: list[str] = []
    genuine = builtins.compile

    def only_a_tree(source: object, *args: object, **options: object) -> object:
        flags = options.get("flags", args[2] if len(args) > 2 else 0)
        if not isinstance(flags, int) or not flags & ast.PyCF_ONLY_AST:
            ran.append("compile")
        return genuine(source, *args, **options)  # type: ignore[call-overload]

    def sentinel(word: str) -> Callable[..., None]:
        return lambda *args, **options: ran.append(word)

    monkeypatch.setattr(builtins, "compile", only_a_tree)
    for word in ("eval", "exec", "open", "input", "breakpoint", "print"):
        monkeypatch.setattr(builtins, word, sentinel(word))
    for home, word in ((os, "system"), (os, "popen"), (subprocess, "Popen")):
        monkeypatch.setattr(home, word, sentinel(word))
    for word in ("sympify", "parse_expr", "S"):
        monkeypatch.setattr(sp, word, sentinel(word))
    try:
        yield ran
    finally:
        monkeypatch.undo()


def hostile(canary: str) -> list[str]:
    """HOSTILE different texts, of all kinds in turn."""
    rng, texts = random.Random(20), dict[str, None]()
    for make in cycle(KINDS):
        texts[make(rng, canary)] = None
        if len(texts) == HOSTILE:
            break
    return list(texts)


def test_a_thousand_hostile_formulas_are_refused_and_none_is_evaluated(tmp_path: Path) -> None:
    canary = tmp_path / "canary"
    texts = hostile(str(canary))
    sentence("sqrt(-1)")  # imports what SymPy imports late, which needs a genuine exec
    took = []
    with guarded() as ran:
        for text in texts:
            start = time.perf_counter()
            sentence(text)
            took.append(time.perf_counter() - start)
    assert len(took) == HOSTILE
    assert max(took) < SLOWEST
    assert sum(took) < SLOWEST
    assert ran == []
    assert not canary.exists()


def test_the_guard_notices_an_evaluation() -> None:
    with guarded() as ran:
        compile("1", "formula", "eval")
        eval("1")
        os.system("true")
    assert ran == ["compile", "eval", "system"]


def test_hostile_formulas_have_no_parameters_to_list_or_are_refused() -> None:
    for text in hostile("canary"):
        try:
            names = parameter_names(text, NAMES)
        except InputError:
            continue
        assert all(n.isidentifier() and n.isascii() and not n.startswith("_") for n in names)


@settings(max_examples=300)
@given(
    text=st.one_of(
        st.text(max_size=60),
        st.text("k0123456789.eE+-*/(), sinmax_", max_size=60),
        st.lists(
            st.sampled_from("k vs 2 0 0.5 1e9 + - * / ** ( ) , sin( max( exp( log( )".split())
        ).map(" ".join),
    )
)
def test_any_text_is_a_finite_expression_or_one_sentence(text: str) -> None:
    try:
        expression = parse_formula(text, NAMES)
    except InputError:
        sentence(text)
        return
    assert not expression.has(sp.zoo, sp.nan, sp.oo, -sp.oo, sp.I)
    assert expression.free_symbols <= set(NAMES.values())


def test_the_parser_calls_nothing_that_could_evaluate() -> None:
    tree = ast.parse(Path(formula.__file__).read_text(encoding="utf-8"))
    used = {n.id for n in ast.walk(tree) if isinstance(n, ast.Name)}
    used |= {n.attr for n in ast.walk(tree) if isinstance(n, ast.Attribute)}
    assert not used & {"exec", "getattr", "sympify", "parse_expr", "__import__", "globals"}
    called = {n.func.id for n in ast.walk(tree) if isinstance(n, ast.Call) and _is_name(n.func)}  # type: ignore[attr-defined]
    assert not called & {"eval", "compile"}


def _is_name(node: ast.expr) -> bool:
    return isinstance(node, ast.Name)
