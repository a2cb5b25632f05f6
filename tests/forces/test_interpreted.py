"""Formulas come and go, and leave nothing behind."""

from __future__ import annotations

import sys
from pathlib import Path

import numba
import numpy as np
import pytest
import sympy as sp

from flexgui.core.arm.cache import VARIABLE
from flexgui.core.effects.own import own_effect
from flexgui.core.effects.own_formula import own_parameter
from flexgui.core.forces.compiled import CompiledLaw, compile_law
from flexgui.core.forces.law import X, joint_law
from tests.helpers import PAPER

A = sp.Symbol("a", real=True)
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
