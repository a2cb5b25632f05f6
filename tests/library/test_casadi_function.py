"""The identified model as a CasADi function, against our own equations and motions."""

from __future__ import annotations

import sys

import numpy as np
import pytest

import flexgui as fg
from flexgui.core.drives.prescribed_joints import PrescribedJoints
from flexgui.core.errors import InputError
from flexgui.core.model import Model
from flexgui.core.results import StateEquations
from flexgui.library.casadi_function import casadi_function
from flexgui.library.identification import Identification
from tests.export.helpers import outcome_of
from tests.export.whole import (
    STEP,
    WHOLE,
    assert_same_motion,
    ends,
    motion,
    random_point,
    rates_by_hand,
    whole_outcome,
)
from tests.helpers import PAPER, jacobian

SAME = 1e-9
"""Relative to one and the rate: two orders of the same sums."""

SAME_MOTION = 1e-6
"""Of a signal's rms; both integrators were asked for a hundredth of it or less."""

TOLERANCE = {"reltol": 1e-11, "abstol": 1e-13, "max_num_steps": 10**6}

SLOPES = 1e-5
"""Relative to the largest slope: ours are central differences."""


def equations_of(name: str) -> StateEquations:
    found = whole_outcome(name).state_equations
    assert found is not None
    return found


def function(name: str, *free: str):  # type: ignore[no-untyped-def]
    pytest.importorskip("casadi", reason="CasADi is not installed: pip install '.[casadi]'")
    return casadi_function(equations_of(name), free)


@pytest.mark.parametrize("name", WHOLE)
def test_rates_at_random_states_are_those_of_arm_drive_and_laws(name: str) -> None:
    f, model = function(name), WHOLE[name]
    for seed in range(20):
        x, r = random_point(whole_outcome(name), seed)
        found = np.array(f(x=x, r=r)["xdot"]).ravel()
        expected = rates_by_hand(model, model.numbers(), x, r)
        np.testing.assert_allclose(found, expected, rtol=SAME, atol=SAME)


@pytest.mark.parametrize("name", ["dry friction", "limited drive"])
def test_cvodes_moves_it_as_we_simulate(name: str) -> None:
    f, model, (task, ours) = function(name), WHOLE[name], motion(name)
    ca = sys.modules["casadi"]
    x, signals = ca.SX.sym("x", f.size1_in(0)), ca.SX.sym("s", 2 * f.size1_in(1))
    first, last = ca.vertsplit(signals, f.size1_in(1))
    t = ca.SX.sym("t")  # share of a sample, since its inputs run straight
    rate = STEP * f(x, first + t * (last - first))[0]
    equations = {"x": x, "p": signals, "t": t, "ode": rate}
    over = ca.integrator("over", "cvodes", equations, 0, 1, TOLERANCE)
    state = np.zeros(f.size1_in(0))
    state[: len(task.start)] = task.start
    states, outputs = [], []
    for sample, r in enumerate(task.signals):
        states.append(state)
        outputs.append(np.array(f(state, r)[1]).ravel())
        if sample + 1 < len(task.signals):
            given = np.append(r, ends(model, task, sample))
            state = np.array(over(x0=state, p=given)["xf"]).ravel()
    q = np.array(states)[:, : model.arm.coordinates]
    assert_same_motion(
        model, q, np.array(outputs), ours.trajectory, whole_outcome(name), SAME_MOTION
    )  # fmt: skip


def test_its_derivatives_are_slopes_of_our_equations() -> None:
    f, model = function("limited drive"), WHOLE["limited drive"]
    x, r = random_point(whole_outcome("limited drive"), 0)
    slopes = np.array(f.jacobian()(x, r, 0, 0)[0])
    numbers = model.numbers()
    expected = jacobian(lambda at: rates_by_hand(model, numbers, at, r), x)
    assert np.abs(slopes - expected).max() <= SLOPES * np.abs(expected).max()


def test_a_free_parameter_is_an_input() -> None:
    f, model = function("dry friction", "fc1", "m2"), WHOLE["dry friction"]
    x, r = random_point(whole_outcome("dry friction"), 3)
    changed = {"fc1": 2.5, "m2": 4.0}
    found = np.array(f(x=x, r=r, k=list(changed.values()))["xdot"]).ravel()
    expected = rates_by_hand(model, model.numbers(changed), x, r)
    np.testing.assert_allclose(found, expected, rtol=SAME, atol=SAME)


def test_a_result_gives_the_function_with_what_is_free() -> None:
    function("slide")
    found = Identification(fg.load("paper_glocal"), whole_outcome("dry friction"))
    f = found.to_casadi(free=["fc1"])
    assert (f.name_in(), f.name_out()) == (["x", "r", "k"], ["xdot", "y"])
    assert found.to_casadi().name_in() == ["x", "r"]


def test_what_cannot_be_made_or_free_is_refused() -> None:
    outcome = outcome_of(Model(PAPER, PrescribedJoints()))
    with pytest.raises(InputError, match="control loop"):
        Identification(fg.load("paper_glocal"), outcome).to_casadi()
    with pytest.raises(InputError, match="'mass' cannot be free"):
        function("dry friction", "mass")


def test_without_casadi_the_command_that_installs_it_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "casadi", None)
    with pytest.raises(InputError, match=r"pip install 'flexgui-arm\[casadi\]'"):
        casadi_function(equations_of("slide"))
