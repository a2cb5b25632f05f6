"""Own formulas: nothing but arithmetic is ever run."""

from __future__ import annotations

import ast
import os
import time
from pathlib import Path

import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from flexgui.core.effects import formula
from flexgui.core.effects.formula import (
    parse_formula,
)
from flexgui.core.errors import InputError
from tests.effects.formula_pieces import NAMES, SLOWEST, sentence
from tests.effects.hostile import HOSTILE, guarded, hostile


def test_a_thousand_hostile_formulas_are_refused_and_none_is_evaluated(tmp_path: Path) -> None:
    canary = tmp_path / "canary"
    texts = hostile(str(canary))
    for text in texts[:100]:
        sentence(text)  # imports what SymPy imports late, which needs a genuine exec
    took = []
    with guarded() as ran:
        for text in texts:
            start = time.thread_time()
            sentence(text)
            took.append(time.thread_time() - start)
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
