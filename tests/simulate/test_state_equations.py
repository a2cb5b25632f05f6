"""The model as statements: read as plain arithmetic they give what the simulator computes."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Sequence

import numpy as np
import pytest

from flexgui.core.drives.known_joints import with_known_motion
from flexgui.core.drives.torque import Torque
from flexgui.core.effects import catalogue
from flexgui.core.model import Model
from flexgui.core.results.state_equations import StateEquations, parts_of
from flexgui.core.simulate.state_equations import state_equations
from flexgui.core.units import base_units
from flexgui.export.expressions import COMMON, Language, translated
from tests.export.whole import FORMULA, rates_by_hand
from tests.helpers import ARMS, PAPER, loaded, looped

SAME = 1e-9
"""Relative to one and the rate: two orders of the same sums, and a mass matrix of condition 1e4."""

FLOATS = Language(
    number=float,
    functions={name: getattr(math, name) for name in COMMON} | {"abs": abs, "min": min, "max": max},
    operators={
        ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
        ast.Div: operator.truediv, ast.Pow: operator.pow, ast.USub: operator.neg,
        ast.Lt: operator.lt, ast.Gt: operator.gt, ast.IfExp: lambda test, a, b: a if test else b,
    },
)  # fmt: skip


def evaluated(
    equations: StateEquations, x: np.ndarray, r: np.ndarray, k: Sequence[float], target: str
) -> np.ndarray:
    known = {f"{a}[{i}]": v for a, array in zip("xrk", (x, r, k), strict=True)
             for i, v in enumerate(array)}  # fmt: skip
    for statement in equations.needed(target):
        left, sign, right = parts_of(statement)
        value = translated(right, FLOATS, known.__getitem__)
        known[left] = known[left] + value if sign == "+=" else value
    size = len(equations.states if target == "rates" else equations.outputs)
    return np.array([known[f"{target}[{i}]"] for i in range(size)])


def made(model: Model) -> StateEquations:
    found = state_equations(model, {})
    assert found is not None
    return found


def assert_same_rates(model: Model, values: dict[str, float]) -> None:
    equations, rng = made(model), np.random.default_rng(8)
    x = rng.uniform(-0.3, 0.3, len(equations.states))
    r = rng.uniform(-1.0, 1.0, len(equations.inputs))
    k = [values.get(each.name, each.value) for each in equations.parameters]
    expected = rates_by_hand(model, model.numbers(values), x, r)
    found = evaluated(equations, x, r, k, "rates")
    np.testing.assert_allclose(found, expected, rtol=SAME, atol=SAME)


@pytest.mark.parametrize("kind", catalogue())
def test_every_effect_is_in_the_rates(kind: str) -> None:
    assert_same_rates(looped(PAPER).with_effects([catalogue()[kind]]), {})


@pytest.mark.parametrize("name", ["slide", "ground", "2-2", "0-2-1"])
def test_every_number_that_may_be_changed_acts_as_in_the_model(name: str) -> None:
    model = looped(loaded(ARMS[name], (1.5, -9.81)), 20.0)
    for each in made(model).parameters:
        assert_same_rates(model, {each.name: 1.4 * each.value + 0.1})


def test_a_table_a_direction_the_time_and_a_torque_of_a_formula_are_in_the_rates() -> None:
    model = looped(PAPER).with_effects([FORMULA])
    assert [each.name for each in made(model).inputs] == ["t", "dtheta1_ref", "dtheta2_ref"]
    assert_same_rates(model, {"a": 0.7, "b": 0.2})


def test_outputs_are_joints_deflections_tip_and_torque_within_its_limit() -> None:
    model = looped(PAPER).with_effects([catalogue()["drive_saturation"]])
    equations, numbers = made(model), model.numbers()
    x = np.array([0.3, -0.2, 0.01, 0.02, *np.zeros(4)])
    k = [each.value for each in equations.parameters]
    found = dict(
        zip(
            [each.name for each in equations.outputs],
            evaluated(equations, x, np.array([1e3, 0.0]), k, "y"), strict=True,
        )
    )  # fmt: skip
    assert (found["theta1"], found["theta2"]) == (0.3, -0.2)
    assert found["deflection1"] == pytest.approx(0.01 * PAPER.segments[0].length)
    place = model.compiled.tip_place(x[:4], numbers.p)[0]
    np.testing.assert_allclose([found["z1"], found["z2"]], place, rtol=1e-14)
    assert found["u1"] == numbers.law.limit[0]


def test_a_changed_value_is_the_parameter_that_is_found() -> None:
    model = looped(PAPER)
    found = state_equations(model, {"m1": 6.5, "unknown": 1.0})
    assert found is not None
    assert {each.name: each.value for each in found.parameters}["m1"] == 6.5


def test_joints_that_follow_a_recording_have_no_rates() -> None:
    assert state_equations(Model(PAPER, with_known_motion(Torque(), [1])), {}) is None


@pytest.mark.parametrize(
    ("unit", "factor", "exponents"),
    [
        ("N m", 1.0, {"kg": 1, "m": 2, "s": -2}),
        ("rad/(N m)", 1.0, {"rad": 1, "s": 2, "kg": -1, "m": -2}),
        ("1/m³", 1.0, {"m": -3}),
        ("Ohm", 1.0, {"kg": 1, "m": 2, "s": -3, "A": -2}),
        ("deg", math.pi / 180.0, {"rad": 1}),
        ("", 1.0, {}),
    ],
)
def test_what_a_unit_consists_of(unit: str, factor: float, exponents: dict[str, int]) -> None:
    found = base_units(unit)
    assert found[0] == pytest.approx(factor, rel=1e-12)
    assert found[1] == exponents
