"""A, B and C of the linear model against differences of the non-linear one."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from flexgui.core.drives import build_drive
from flexgui.core.drives.drive import Drive
from flexgui.core.model import Model
from flexgui.core.sensors import sensors
from flexgui.core.simulate.descriptor import descriptor
from flexgui.core.simulate.posture import posture
from flexgui.core.trajectory import Trajectory
from tests.drives.test_contract import OPTIONS
from tests.helpers import (
    ARMS,
    EVERY_ARM,
    jacobian,
    loaded,
    looped,
    random_state,
    state_matrices,
    state_rate,
    straight,
)

DIFFERENCES = 1e-6
"""Relative to the largest entry of a row: central differences, and a solve with M."""

GRAVITY = (2.0, -9.81)
LOOP_GAIN = 20.0

PURE = {name: OPTIONS["state_feedback"][name] for name in ("gains", "torque_constants")}
FILTERS = {name: OPTIONS["state_feedback"][name] for name in ("rate_filter", "gauge_filter")}
UNFILTERED = build_drive("state_feedback", PURE)
FILTERED = build_drive("state_feedback", {**PURE, **FILTERS})
CASCADE = build_drive("cascade", OPTIONS["cascade"])

LINEAR_OUTPUTS = [
    (kind, name)
    for kind in sorted(set(sensors()) - {"z", "acceleration"})
    for name in ("1-1", "3-3", "0-2-1", "slide")
    if kind not in ("y", "ydot") or ARMS[name].two_revolute
]
"""All but those that are not linear in the state."""


def largest_miss(A: np.ndarray, slope: np.ndarray) -> float:
    """Largest difference relative to the largest entry of its row."""
    size = np.abs(A).max(axis=1, keepdims=True)
    return float((np.abs(A - slope) / np.where(size > 0.0, size, 1.0)).max())


def check_against_differences(model: Model, gravity: bool) -> None:
    """Under gravity M stays that of the working point: E(kappa) x' = A x + B u is linearised
    about a state that is held, where q'' = 0 and the slope of M plays no part."""
    numbers = model.numbers()
    arm, states = model.arm, numbers.law.states
    joints = random_state(arm, seed=11)[0][: arm.joints]
    q = straight(joints, arm)
    x = np.concatenate([q, np.zeros(arm.coordinates + states)])
    inertia = model.compiled.mass_matrix(q, numbers.p) if gravity else None
    # References and filters such that the drive rests at this point, as in a real experiment.
    law = numbers.law
    s = -np.linalg.solve(law.Fs, law.Fq @ q) if states else np.zeros(0)
    x[2 * arm.coordinates :] = s
    r = np.linalg.lstsq(law.R, law.P @ q + law.S @ s, rcond=None)[0]
    A, B = state_matrices(model, numbers, joints)
    slope_x = jacobian(lambda y: state_rate(model, numbers, y, r, inertia), x)
    slope_r = jacobian(lambda y: state_rate(model, numbers, x, y, inertia), r)
    assert largest_miss(A, slope_x) < DIFFERENCES
    assert largest_miss(B, slope_r) < DIFFERENCES


@pytest.mark.parametrize("gravity", [False, True], ids=["level", "gravity"])
@pytest.mark.parametrize("name", EVERY_ARM)
def test_linear_model_is_the_slope_of_the_non_linear_one(name: str, gravity: bool) -> None:
    arm = loaded(ARMS[name], GRAVITY if gravity else (0.0, 0.0))
    check_against_differences(looped(arm, LOOP_GAIN), gravity)


@pytest.mark.parametrize("drive", [FILTERED, UNFILTERED, CASCADE], ids=["filtered", "pure", "pos"])
@pytest.mark.parametrize("name", ["1-1", "3-3"])
def test_drive_feedback_is_part_of_the_linear_model(name: str, drive: Drive) -> None:
    check_against_differences(Model(loaded(ARMS[name]), drive), gravity=False)


@pytest.mark.parametrize(("kind", "name"), LINEAR_OUTPUTS)
def test_linear_outputs_are_the_slope_of_the_sensors(name: str, kind: str) -> None:
    arm, sensor = loaded(ARMS[name]), sensors()[kind]
    model = looped(arm, LOOP_GAIN)
    p, law, *_ = model.numbers()
    rows = sensor.rows(arm, p, law)
    assert rows is not None
    n = arm.coordinates
    q0 = straight(np.arange(arm.joints) * 0.4 + 0.9, arm)

    def read(x: np.ndarray) -> np.ndarray:
        q, v = x[None, :n], x[None, n:]
        torque = -q @ law.P.T - v @ law.V.T
        return sensor.measure(Trajectory(arm, model.compiled, p, np.zeros(1), q, v, torque))[0]

    slope = jacobian(read, np.concatenate([q0, np.zeros(n)]))
    assert np.abs(slope - np.hstack([rows.Q, rows.V])).max() < DIFFERENCES


SAME = 1e-10
"""Relative to the largest entry: two orders of evaluation."""

NAMES = ["one mode", "1-1", "2-2", "slide", "ground", "0-2-1"]


def summed(terms: np.ndarray, basis: tuple[str, ...], joints: np.ndarray) -> np.ndarray:
    places = {f"theta{k + 1}": x for k, x in enumerate(joints)}
    factors = [float(sp.sympify(text).subs(places)) for text in basis]
    return np.asarray(np.tensordot(factors, terms, axes=1))


@pytest.mark.parametrize("gravity", [(0.0, 0.0), (1.5, -9.81)], ids=["level", "upright"])
@pytest.mark.parametrize("name", NAMES)
def test_the_terms_add_up_to_the_posture(name: str, gravity: tuple[float, float]) -> None:
    model = looped(loaded(ARMS[name], gravity), 20.0)
    found = descriptor(model, model.numbers())
    joints = 0.4 + 0.7 * np.arange(model.arm.joints)
    here = posture(model, joints)
    for terms, basis, exact in (
        (found.E_terms, found.basis, here.E), (found.A_terms, found.A_basis, here.A),
    ):  # fmt: skip
        assert np.abs(summed(terms, basis, joints) - exact).max() <= SAME * np.abs(exact).max()
    assert np.array_equal(found.B, here.B)


def test_of_the_papers_kind_of_arm_only_cos_theta2_enters() -> None:
    model = looped(ARMS["2-2"])
    found = descriptor(model, model.numbers())
    assert (found.basis, found.A_basis) == (("1", "cos(theta2)"), ("1",))
