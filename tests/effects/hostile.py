"""Formulas that no parser should run, and a guard that sees whether one does."""

from __future__ import annotations

import ast
import builtins
import keyword
import os
import random
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import cycle

import pytest
import sympy as sp

from flexgui.core.effects.formula import (
    DEEPEST,
    MOST_NODES,
)
from flexgui.core.effects.real_functions import FUNCTIONS

HOSTILE = 1000


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
