"""What the benchmark compares with computes what we compute; its table hides no strong rival."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexgui.core.simulate.batch import run
from tests.programs.bench.casadi_arm import CasadiArm, lacking
from tests.programs.bench.case import AWAY, glocal_case
from tests.programs.bench.comparisons.nonlinear import Case, make_case
from tests.programs.bench.peers import (
    Response,
    exact_response,
    lsim_response,
    modal_response,
    peer_cost,
)

SECONDS = 0.05
needs_casadi = pytest.mark.skipif(bool(lacking()), reason=lacking() or "everything is there")


@pytest.mark.parametrize("response", [modal_response, lsim_response, exact_response])
def test_costs_of_the_linear_rivals_are_ours(response: Response) -> None:
    case = glocal_case(SECONDS)
    ours = float(case.cost(AWAY)[0])
    assert peer_cost(case, response, AWAY) == pytest.approx(ours, rel=1e-11)


@pytest.fixture(scope="module", params=[1, 2])
def case(request: pytest.FixtureRequest) -> Case:
    return make_case(request.param, SECONDS)


@needs_casadi
def test_casadi_has_our_equations(case: Case) -> None:
    import casadi as ca

    arm, n = CasadiArm(case.model), case.model.arm.coordinates
    y, r, theta = arm.symbols
    evaluate = ca.Function("sides", [y, r, theta], list(arm.right_side(y[:n], y[n:])))
    state = 0.05 * np.random.default_rng(1).standard_normal(2 * n)
    M, f = evaluate(state, np.zeros(r.shape[0]), [0.0, *case.stiffness[0]])
    numbers = case.model.numbers()
    expected, force = case.model.compiled.mass_and_force(state[:n], state[n:], numbers.p)
    force[: case.model.arm.joints] -= numbers.law.P @ state[:n] + numbers.law.V @ state[n:]
    assert np.array(M) == pytest.approx(expected, rel=1e-11)
    assert np.array(f).ravel() == pytest.approx(force, rel=1e-9)


@needs_casadi
def test_casadi_steps_as_we_do(case: Case, tmp_path: Path) -> None:
    ours = run(case.model, case.model.numbers(), case.task, 2)
    found = CasadiArm(case.model).states(tmp_path)(case.task, case.stiffness[0], 2)
    scale = np.abs(ours.q).max(axis=0)
    assert np.abs((found[:, : ours.q.shape[1]] - ours.q) / scale).max() < 1e-9


@needs_casadi
def test_casadi_sensitivities_are_slopes_of_the_tip(tmp_path: Path) -> None:
    case = make_case(1, SECONDS)
    sensed = CasadiArm(case.model).slopes(tmp_path)
    found = sensed(case.task, case.stiffness[0], 2)
    ours = run(case.model, case.model.numbers(), case.task, 2)
    assert np.abs(found[:, :2] - ours.tip()[0]).max() < 1e-12
    step = 1e-5 * case.stiffness[0] * [0.0, 1.0]
    up, down = (sensed(case.task, case.stiffness[0] + s, 2)[:, :2] for s in (step, -step))
    slopes = (up - down) / (2.0 * step[1])
    assert found[:, 4:] == pytest.approx(slopes, abs=1e-6 * np.abs(slopes).max())
