"""Formulas that no parser should run, and a guard that sees whether one does."""

from __future__ import annotations

import ast
import builtins
import keyword
import os
import random
import re
import subprocess
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import cycle

import pytest
import sympy as sp

from flexgui.core.effects.formula import DEEPEST, MOST_NODES
from flexgui.core.effects.real_functions import FUNCTIONS

HOSTILE = 1000
RNG = random.Random(20)
SMALL = [str(k) for k in range(1, 100)]
DEPTHS = (DEEPEST + 1, 50, 100, 240, 1000, 10**4, 10**5)
PAIRS = (("(", ")"), ("sin(", ")"), ("-(", ")"), ("[", "]"), ("(", ""))


def several(make: Callable[[], str]) -> list[str]:
    return [make() for _ in range(40)]


POOLS: dict[str, Sequence[str]] = {
    "any": ("k", "theta1", "2.5", "sin(k)", "fc*vs", "(k + 1)"),
    "word": "real diff subs evalf __class__ __init__ func args name".split(),
    "hidden": "import builtins class globals subclasses debug name".split(),
    "exponent": ("9", "1e9", "99999999", "-9", "1e-3", "0.3", "(2*9)", "(k)", "--2"),
    "large": several(lambda: str(RNG.randint(100, 10**9))),
    "small": SMALL,
    "long": several(lambda: "".join(RNG.choices("123456789", k=RNG.choice((40, 200, 450, 5000))))),
    "odd": (
        "1e999 -1e999 1e-999 1j 2.5J 1_000 0x1F 0b11 0o17 007 1e 1.2.3 1..real ... inf nan 3k"
    ).split(),
    "tower": several(lambda: "**".join(RNG.choices(SMALL[1:], k=RNG.randint(3, 30)))),
    "deep": [left * n + "k" + right * n for n in DEPTHS for left, right in PAIRS],
    "nested": [
        "(".join(RNG.choices(("sin", "exp", "tanh", "cosh"), k=n)) + "(k" + ")" * n
        for n in range(7, 21)
    ],
    "chain": [sign * n + "k" for sign in "-~+" for n in (MOST_NODES, 300, 10**4)],
    "character": "\x00\n\r\t\f\x0b\x1b\u2028\u202e\ufeff\ud800;#\\`$?!&|~%@:",
    "lookalike": "аеорсхукѕіјԁΑΒΕ１２３＋＊（）٣۴²½ªℯ𝐤𝑘ﬁ‿−∗⁄",  # noqa: RUF001
    "function": sorted(FUNCTIONS),
    "inside": ("x=k", "*k", "**k", "k, evaluate=0", "", "k, k, k, k", "*(k, k)", "k, *k"),
    "keyword": keyword.kwlist,
    "thing": (
        "k(1)", "2(k)", "sin(k)(k)", "(sin)(k)(k)", "eval(k)", "exec(k)", "open(k)", "vs()",
        "sympify(k)", "getattr(k, k)", "compile(k)", "input()", "breakpoint()", "exit()",
    ),
    "operator": "// % @ << >> & | == < := = !=".split(),
    "zero": ("0", "0.0", "(k - k)", "(0*k)", "sin(0)", "(vs - 1.0*vs)", "log(1)"),
    "call": (
        "open('CANARY', 'w')", "os.system('touch CANARY')", "eval('1')", "exec('x=1')", "print(k)"
    ),
}  # fmt: skip
KINDS: tuple[Sequence[str], ...] = (
    ("<any>.<word>", "<any>.<word>.<word>", "<any>.<word>.<word>.<word>"),
    ("__<hidden>__", "__<hidden>__(k)", "k + __<hidden>__", "_<hidden>", "__<hidden>"),
    ("<any>**<exponent>", "<any>**<exponent>**2", "<any>**<exponent>*k"),
    ("exp(<large>)", "cosh(<large>)", "<large>**8**1", "exp(exp(exp(<large>)))"),
    ("<long>", "k*<long>", "1/<long>", "1e<long>", "k-<long>.5"),
    ("<odd>", "k*<odd>", "sin(<odd>)"),
    ("<tower>",), ("<deep>",), ("<nested>",), ("<chain>",),
    ("<any><character>*k", "k*<character><any>", "<any>*<character>k"),
    ("<any>*<lookalike>",),
    ("<function>(<inside>)",),
    ("<keyword>", "k + <keyword>", "(<keyword> k)", "k <keyword> vs", "<keyword>(k)"),
    ("<thing>", "k*<thing>", "exp(<thing>)"),
    ("(k, <any>)", "k, <any>", "()", "(<any>,)", "(k)*(<any>, 2)"),
    ("<any><operator><any>",),
    ("1/<zero>", "k/<zero>", "<zero>**-1", "log(<zero>)", "0/<zero>", "<zero>/<zero>"),
    ("sqrt(-<small>)", "log(-<small>)", "asin(1<small>)", "acos(-1<small>)", "(-<small>)**0.5"),
    (
        "<call>", "k + <call>", "sin(<call>)", "(lambda: <call>)()", "[<call> for i in (1,)]",
        "{<call>}", "(k := <call>)", "f'{<call>}'", "k if <call> else vs", "k[<call>]",
        "k and <call>", "not <call>", "(yield <call>)", "await <call>", "{i: <call> for i in (1,)}",
        "k < <call>", "'<call>'", 'b"<call>"', "__import__('os') or <call>", "k\n<call>",
    ),
    ("import os", "from os import system", "__import__('os').system('touch CANARY')"),
    ("k[0]", "k[k]", "[k][0]", "(k, vs)[0]", "{'a': k}['a']", "k[::2]", "[k]"),
    (
        "True", "None*k", "k and vs", "k or <any>", "not k", "k is <any>", "k in <any>",
        "k < <any>", "k if vs else <any>", "k if vs < 1 else <any>",
    ),
    ("k +", "* k", "k <any>", "k * * <any>", "(k", "k)", ")k(", "", " ", "k,,<any>"),
)  # fmt: skip
"""Frames of each kind; a name in angles stands for any of its pool."""


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
    texts = dict[str, None]()
    for frames in cycle(KINDS):
        text = re.sub(r"<([a-z]+)>", lambda m: RNG.choice(POOLS[m[1]]), RNG.choice(frames))
        texts[text.replace("CANARY", canary)] = None
        if len(texts) == HOSTILE:
            break
    return list(texts)
