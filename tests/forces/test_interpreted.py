"""Formulas come and go, and leave nothing behind."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from flexgui.core.arm.cache import VARIABLE
from flexgui.core.effects.own import own_effect, own_parameter
from flexgui.core.forces.compiled import CompiledLaw, compile_law, compile_wide_law
from flexgui.core.forces.generate import module_text
from flexgui.core.forces.interpreted import InterpretedLaw
from flexgui.core.forces.law import V, X, joint_law
from tests.helpers import PAPER

ROUNDING = 1e-12
"""Relative: the same arithmetic, in another order of the processor's."""

A = sp.Symbol("a", real=True)
FORMULAS = ("-a*tanh(dtheta1/{})", "a*theta1**3/{}", "-a*sqrt(dtheta1**2 + 1e-{})*sign(theta1)")


def tried(k: int) -> InterpretedLaw:
    formula = FORMULAS[k % 3].format(k + 1)
    parameters = (own_parameter("a", 0.5, "N m"),)
    made = own_effect(PAPER, "joint1", formula, parameters, f"own-{k}")
    found = compile_law(made.stated)
    assert isinstance(found, InterpretedLaw)
    return found


def test_a_formula_that_is_tried_leaves_no_file_no_module_and_no_compiled_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    modules = set(sys.modules)
    laws = [tried(k) for k in range(30)]
    assert not list(tmp_path.rglob("*"))
    assert not {name for name in set(sys.modules) - modules if "force" in name or "formula" in name}
    assert not any("_function" in vars(law) for law in laws)


def test_neither_does_one_that_an_integrator_calls(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    law = tried(1000)
    assert law.address and compile_wide_law(law.law).address
    assert not list(tmp_path.rglob("*"))


@pytest.mark.parametrize(
    "force",
    [-A * sp.tanh(V / 0.01), A * X**3 / 7, -A * sp.sqrt(V**2 + 1e-6), A * sp.atan2(V, 2 + X**2)],
)
def test_in_plain_python_it_gives_what_is_compiled(force: sp.Expr) -> None:
    law = joint_law(force, (A,))
    plain, compiled = (
        InterpretedLaw(law),
        CompiledLaw(law, InterpretedLaw(law, module_text)._function),
    )
    random = np.random.default_rng(1)
    for _ in range(20):
        x, v, a = random.normal(size=(3, 1))
        expected = compiled(x, v, np.zeros(0), a)
        assert np.allclose(plain(x, v, np.zeros(0), a), expected, rtol=ROUNDING, atol=ROUNDING)


@pytest.mark.parametrize("force", [A / X, A * sp.log(X), A * sp.sqrt(X - 1), A * X**-0.5])
def test_what_does_not_exist_at_rest_is_not_finite_and_no_error(force: sp.Expr) -> None:
    rest = np.zeros(1)
    out = InterpretedLaw(joint_law(force, (A,)))(rest, rest, np.zeros(0), np.ones(1))
    assert not np.isfinite(out).all()
