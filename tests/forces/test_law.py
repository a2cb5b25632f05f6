"""What is stated in symbols is what is compiled."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Sequence
from pathlib import Path

import numba
import numpy as np
import pytest
import sympy as sp
from hypothesis import assume, given
from hypothesis import strategies as st

from flexgui.core.arm.cache import VARIABLE, cache_folder
from flexgui.core.effects.own import own_effect
from flexgui.core.effects.own_formula import own_parameter
from flexgui.core.effects.real_functions import FUNCTIONS
from flexgui.core.forces.compiled import CompiledLaw, compile_law
from flexgui.core.forces.generate import module_text
from flexgui.core.forces.law import ForceLaw, V, W, X, joint_law
from flexgui.core.lanes.wide import LANES
from tests.helpers import PAPER

ROUNDING = 1e-12
"""Relative to the terms of the sum; printing must not change a number."""

A, B = sp.symbols("a b", positive=True)

LAWS = {
    "spring and damper": joint_law(-A * X - B * V, (A, B)),
    "dry friction": joint_law(-A * sp.tanh(V / B), (A, B)),
    "corner": joint_law(-A * sp.Abs(V) - B * sp.sign(X), (A, B)),
    "dead zone": joint_law(-A * (X - sp.Max(-B, sp.Min(X, B))), (A, B)),
    "pieces": joint_law(sp.Piecewise((-A * X, X > 0), (B * X**2, True)), (A, B)),
    "fractions": joint_law(sp.Rational(1, 3) * A * X ** sp.Rational(2, 1) + sp.sqrt(B), (A, B)),
    "functions": joint_law(sp.exp(-A * X**2) * sp.cos(B * X) + sp.atan2(V, A), (A, B)),
    "bristles": joint_law(-A * W / B, (A, B), rate=V - sp.Abs(V) * W / B),
    "step": joint_law(A * sp.Heaviside(X - B, 0), (A, B)),
}

TWO_PORTS = ForceLaw(
    (X, sp.Symbol("x2", real=True)),
    (V, sp.Symbol("v2", real=True)),
    (-A * X, -B * sp.Symbol("v2", real=True) * sp.sqrt(V**2 + A)),
    (A, B),
    (W,),
    (V - A * W,),
)

POINTER = ctypes.POINTER(ctypes.c_double)
C_FUNCTION = ctypes.CFUNCTYPE(None, *[POINTER] * 5)


def forms(law: ForceLaw, *arguments: Sequence[float]) -> list[np.ndarray]:
    """The law's outputs in plain Python, of one arm and in each of LANES arms."""
    found, compiled = [], compile_law(law)
    for address, lanes in ((compiled.address, 1), (compiled.wide_address, LANES)):
        arrays = [np.repeat(np.array(a, dtype=float), lanes) for a in arguments]
        out = np.zeros(law.size * lanes)
        C_FUNCTION(address)(*(a.ctypes.data_as(POINTER) for a in (*arrays, out)))
        found += list(out.reshape(-1, lanes).T)
    return [compiled(*(np.array(a) for a in arguments)), *found]


number = st.floats(-2.0, 2.0).filter(lambda x: abs(x) > 1e-3)


def evaluated(law: ForceLaw, x, v, w, e) -> np.ndarray:  # type: ignore[no-untyped-def]
    """The law's outputs by SymPy's own substitution."""
    names = (*law.x, *law.v, *law.states, *law.parameters)
    numbers = dict(zip(names, (*x, *v, *w, *e), strict=True))
    found = [
        output.subs(numbers).replace(sp.DiracDelta, lambda *_: sp.Integer(0)).evalf(17)
        for output in law.outputs()
    ]
    return np.array(found, dtype=float)


@pytest.mark.parametrize("name", LAWS)
@given(x=number, v=number, w=number, a=st.floats(0.1, 3.0), b=st.floats(0.1, 3.0))
def test_compiled_numbers_are_those_of_the_symbols(name, x, v, w, a, b) -> None:  # type: ignore[no-untyped-def]
    law = LAWS[name]
    states = [w][: len(law.states)]
    assume(abs(x) != b)  # in a corner a slope is what one chooses it to be
    expected = evaluated(law, [x], [v], states, [a, b])
    for out in forms(law, [x], [v], states, [a, b]):
        assert np.abs(out - expected).max() <= ROUNDING * (1.0 + np.abs(expected).max())


def test_two_ports_and_a_state_keep_their_order() -> None:
    root = np.sqrt(9.0 + 4.0)
    expected = [-2.0, -14.0 * root, -4.0, 0.0, 0.0, -7.0 * root, 2.6, 0.0, 1.0, -4.0]
    for out in forms(TWO_PORTS, [0.5, 0.0], [3.0, 2.0], [0.1], [4.0, 7.0]):
        assert np.allclose(out, expected, rtol=ROUNDING)


@pytest.mark.parametrize("word", FUNCTIONS)
def test_a_function_of_formulas_is_the_same_in_every_form(word: str) -> None:
    function = FUNCTIONS[word]
    arguments = (X, V)[: next(iter(function.nargs))]
    plain, *compiled = forms(joint_law(A * function(*arguments), (A,)), [0.4], [0.3], [], [2.0])
    assert plain[0] == pytest.approx(2.0 * function.value(*(0.4, 0.3)[: len(arguments)]))
    for out in compiled:
        assert np.allclose(out, plain, rtol=ROUNDING, atol=ROUNDING)


@pytest.mark.parametrize("name", ["x", "out", "lambda", "e", "c0", "s1", "__import__"])
def test_any_name_of_a_parameter_is_harmless(name: str) -> None:
    """Symbols are renamed: the text of a law never holds a name that someone chose."""
    own = sp.Symbol(name, positive=True)
    law = joint_law(-own * X + sp.cos(own * V) * sp.cos(own * V), (own,))
    for out in forms(law, [2.0], [0.5], [], [3.0]):
        assert out[0] == pytest.approx(-6.0 + np.cos(1.5) ** 2, rel=ROUNDING)
    assert name in ("x", "out", "e", "c0", "s1") or name not in module_text(law)


def test_a_parameter_that_is_a_port_too_is_refused() -> None:
    with pytest.raises(ValueError, match="one symbol stands for two things"):
        joint_law(-sp.Symbol("x", real=True) * V, (X,))


def test_a_law_is_compiled_once_and_kept_as_a_file() -> None:
    first = compile_law(LAWS["dry friction"])
    assert first.address and first.wide_address
    assert compile_law(joint_law(-A * sp.tanh(V / B), (A, B))) is first
    assert list(cache_folder().glob("force_*.py")) and list(cache_folder().glob("wide_force_*.py"))
    assert not list(cache_folder().glob("*force_*.tmp"))


FORMULAS = ("-a*tanh(dtheta1/{})", "a*theta1**3/{}", "-a*sqrt(dtheta1**2 + 1e-{})*sign(theta1)")


def tried(k: int) -> CompiledLaw:
    formula = FORMULAS[k % 3].format(k + 1)
    parameters = (own_parameter("a", 0.5, "N m"),)
    made = own_effect(PAPER, "joint1", formula, parameters, f"own-{k}")
    return compile_law(made.stated)


def test_a_formula_that_is_tried_leaves_no_file_no_module_and_no_compiled_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    modules = set(sys.modules)
    monkeypatch.setattr(numba, "cfunc", None)
    for k in range(30):
        tried(k)(np.ones(1), np.ones(1), np.zeros(0), np.ones(1))
    assert not list(tmp_path.rglob("*"))
    assert not {name for name in set(sys.modules) - modules if "force" in name or "formula" in name}


def test_neither_does_one_that_an_integrator_calls(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    law = tried(1000)
    assert law.address and law.wide_address
    assert not list(tmp_path.rglob("*"))


@pytest.mark.parametrize("force", [A / X, A * sp.log(X), A * sp.sqrt(X - 1), A * X**-0.5])
def test_what_does_not_exist_at_rest_is_not_finite_and_no_error(force: sp.Expr) -> None:
    rest = np.zeros(1)
    out = CompiledLaw(joint_law(force, (A,)))(rest, rest, np.zeros(0), np.ones(1))
    assert not np.isfinite(out).all()
