"""Where the tip is, and the fictitious rigid arm that shares it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgui.core.arm.slots import arm_vector
from flexgui.core.errors import InputError
from flexgui.core.sensors.rigid_rates import rigid_angle_matrix, rigid_angles, rigid_rates
from tests.helpers import ARMS, EVERY_ARM, PAPER, compiled, jacobian, random_state

ROUNDING = 1e-12
"""m; places of about 1 m in double precision."""

DIFFERENCES = 1e-9
"""Central differences of fourth order with a step of 1e-3."""

angles = st.floats(-3.0, 3.0)
bends = st.floats(-0.5, 0.5)


def tip_as_printed(q: np.ndarray, l1: float, l2: float) -> np.ndarray:
    """z of design section 2, (3) of the paper."""
    t1, t2, v1, v2 = q
    t12 = t1 + t2 + 2 * l1 * v1
    a1, a2 = l1 - 2 / 3 * l1**3 * v1**2, l2 - 2 / 3 * l2**3 * v2**2
    b1, b2 = l1**2 * v1, l2**2 * v2
    return np.array(
        [
            a1 * np.cos(t1) - b1 * np.sin(t1) + a2 * np.cos(t12) - b2 * np.sin(t12),
            a1 * np.sin(t1) + b1 * np.cos(t1) + a2 * np.sin(t12) + b2 * np.cos(t12),
        ]
    )


@given(angles, angles, bends, bends)
def test_tip_is_the_printed_formula(t1: float, t2: float, v1: float, v2: float) -> None:
    q = np.array([t1, t2, v1, v2])
    z, _ = compiled(PAPER).tip_place(q, arm_vector(PAPER))
    assert np.abs(z - tip_as_printed(q, 0.5, 0.5)).max() < ROUNDING


@pytest.mark.parametrize("name", EVERY_ARM)
def test_tip_jacobian_is_the_slope_of_the_tip(name: str) -> None:
    arm = ARMS[name]
    p, code = arm_vector(arm), compiled(arm)
    for seed in range(3):
        q = random_state(arm, seed)[0]
        J = jacobian(lambda x: code.tip_place(x, p)[0], q)
        assert np.abs(code.tip_place(q, p)[1] - J).max() < DIFFERENCES


def test_c1_is_equation_9() -> None:
    C1 = rigid_angle_matrix(PAPER, arm_vector(PAPER))
    assert np.array_equal(C1, [[1.0, 0.0, 0.5, 0.0], [0.0, 1.0, 0.5, 0.5]])


@pytest.mark.parametrize("name", ["1-1", "2-2", "3-3"])
def test_c1_is_the_slope_of_the_rigid_angles(name: str) -> None:
    arm = ARMS[name]
    p, code = arm_vector(arm), compiled(arm)
    l1, l2 = (s.length for s in arm.segments)

    def y(q: np.ndarray) -> np.ndarray:
        return rigid_angles(q[None, :2], code.tip_place(q, p)[0][None], l1, l2)[0]

    q0 = np.zeros(arm.coordinates)
    q0[:2] = 0.4, 1.1
    assert np.abs(jacobian(y, q0) - rigid_angle_matrix(arm, p)).max() < DIFFERENCES


@given(angles, st.floats(0.1, 3.0), st.sampled_from([-1.0, 1.0]), st.integers(-2, 2))
def test_rigid_arm_of_a_rigid_motion_is_the_motion(
    t1: float, t2: float, side: float, turns: int
) -> None:
    theta = np.array([[t1 + 2 * np.pi * turns, side * t2]])
    l1, l2 = 0.5, 0.3
    z = np.column_stack(
        [
            l1 * np.cos(theta[:, 0]) + l2 * np.cos(theta.sum(axis=1)),
            l1 * np.sin(theta[:, 0]) + l2 * np.sin(theta.sum(axis=1)),
        ]
    )
    near_singular = 1e-9  # acos loses half the digits where the arm is nearly straight
    assert np.abs(rigid_angles(theta, z, l1, l2) - theta).max() < near_singular


def test_rates_of_the_rigid_arm_are_the_slope_of_its_angles() -> None:
    rng = np.random.default_rng(7)
    z0, speed = np.array([0.4, 0.5]), rng.standard_normal(2)
    theta = np.array([[0.2, 1.2]])

    def y(t: np.ndarray) -> np.ndarray:
        return rigid_angles(theta, (z0 + t[0] * speed)[None], 0.5, 0.5)[0]

    slope = jacobian(y, np.zeros(1))[:, 0]
    rate = rigid_rates(y(np.zeros(1))[None], speed[None], 0.5, 0.5)[0]
    assert np.abs(slope - rate).max() < DIFFERENCES


@pytest.mark.parametrize("name", ["one mode", "slide", "0-2-1"])
def test_other_arms_have_no_rigid_arm_and_are_offered_z(name: str) -> None:
    with pytest.raises(InputError, match='output = "z"'):
        rigid_angle_matrix(ARMS[name], arm_vector(ARMS[name]))
