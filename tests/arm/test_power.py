"""Forces and energies belong together, at any bent state of any arm."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from flexgui.core.arm.arm import Structure
from flexgui.core.arm.kinematics import Kinematics, components
from flexgui.core.arm.slots import LENGTH, MASS, TIP_MASS, arm_vector
from tests.helpers import ARMS, EVERY_ARM, compiled, jacobian, loaded, random_state, straight

BALANCE = 1e-8
"""Relative to the power's parts: differences of fourth order lose about half the digits."""

STEP = 1e-4


def without_damping(arm):  # type: ignore[no-untyped-def]
    segments = tuple(s.model_copy(update={"damping_time": 0.0}) for s in arm.segments)
    return arm.model_copy(update={"segments": segments})


@pytest.mark.parametrize("name", EVERY_ARM)
def test_undriven_undamped_motion_keeps_its_kinetic_and_bending_energy(name: str) -> None:
    """dT/dt + dV/dt = v'(F + K q) - v' K q + 1/2 v' (dM/dt) v = 0 without damping and gravity."""
    arm = without_damping(loaded(ARMS[name]))
    p, code = arm_vector(arm), compiled(arm)
    K, _ = code.linear_matrices(np.zeros(arm.coordinates), p)
    for seed in range(4):
        q, v = random_state(arm, seed)
        inertial = code.mass_and_force(q, v, p)[1] + K @ q

        def kinetic(t: np.ndarray, q: np.ndarray = q, v: np.ndarray = v) -> np.ndarray:
            return np.array([0.5 * v @ code.mass_matrix(q + t[0] * v, p) @ v])

        moving = jacobian(kinetic, np.zeros(1), STEP)[0, 0]
        parts = np.abs(v) @ np.abs(inertial) + abs(moving)
        assert abs(v @ inertial + moving) < BALANCE * max(parts, 1.0)


def gravity_potential(kinematics: Kinematics) -> sp.Expr:
    """V_g = - sum of masses times g . p, integrated over each segment."""
    s = kinematics.symbols
    g = sp.Matrix(s.gravity)
    total = sp.Integer(0)
    for k in range(kinematics.structure.segments):
        length = s.slot(k, LENGTH)
        place = components(kinematics.point(k, s.x))
        height = sp.integrate(sp.expand(place.dot(g)), (s.x, 0, length))
        tip = components(kinematics.segment_tip(k)).dot(g)
        total -= s.slot(k, MASS) / length * height + s.slot(k, TIP_MASS) * tip
    return total


@pytest.mark.parametrize("name", ["1-1", "ground"])
def test_gravity_is_the_slope_of_its_stated_potential(name: str) -> None:
    arm = loaded(ARMS[name], GRAVITY)
    kinematics = Kinematics(Structure.of(arm))
    potential = sp.lambdify(
        [kinematics.symbols.q, kinematics.symbols.p], gravity_potential(kinematics)
    )
    free, pulled = arm_vector(loaded(ARMS[name])), arm_vector(arm)
    code, still = compiled(arm), np.zeros(arm.coordinates)
    for seed in range(3):
        q = random_state(arm, seed)[0]
        force = code.mass_and_force(q, still, pulled)[1] - code.mass_and_force(q, still, free)[1]
        slope = jacobian(lambda x: np.array([potential(x, pulled)]), q)[0]
        assert np.abs(force + slope).max() < BALANCE * np.abs(force).max()


def test_gravity_torque_of_a_straight_horizontal_arm_is_its_first_moment() -> None:
    arm = loaded(ARMS["1-1"], (0.0, -9.81))
    force = compiled(arm).mass_and_force(np.zeros(4), np.zeros(4), arm_vector(arm))[1]
    (l1, m1, t1), (l2, m2, t2) = ((s.length, s.mass, s.tip_mass) for s in arm.segments)
    second = 9.81 * (m2 * l2 / 2 + t2 * l2)
    first = 9.81 * (m1 * l1 / 2 + t1 * l1 + (m2 + t2) * l1) + second
    assert force[:2] == pytest.approx([-first, -second], rel=1e-12)


@pytest.mark.parametrize("name", EVERY_ARM)
def test_kelvin_voigt_damping_never_injects_power(name: str) -> None:
    arm = loaded(ARMS[name])
    damped, undamped = arm_vector(arm), arm_vector(without_damping(arm))
    code = compiled(arm)
    for seed in range(20):
        q, v = random_state(arm, seed, bend=0.2)
        force, free = (code.mass_and_force(q, v, p)[1] for p in (damped, undamped))
        rounding = 1e-12 * (np.abs(v) @ np.abs(force))
        assert v @ (force - free) <= rounding


DIFFERENCES = 1e-8
"""Relative to the largest entry; central differences of fourth order."""

GRAVITY = (2.0, -9.81)


@pytest.mark.parametrize("name", EVERY_ARM)
def test_stiffness_and_damping_are_the_slopes_of_the_force(name: str) -> None:
    arm = loaded(ARMS[name], GRAVITY)
    p, code, still = arm_vector(arm), compiled(arm), np.zeros(arm.coordinates)
    for seed in range(2):
        q = straight(random_state(arm, seed)[0][: arm.joints], arm)
        K, D = code.linear_matrices(q, p)
        slope_q = jacobian(lambda x: code.mass_and_force(x, still, p)[1], q)
        slope_v = jacobian(lambda x, q=q: code.mass_and_force(q, x, p)[1], still)
        assert np.abs(K + slope_q).max() < DIFFERENCES * np.abs(K).max()
        assert np.abs(D + slope_v).max() < DIFFERENCES * max(np.abs(D).max(), 1.0)


@pytest.mark.parametrize("name", ["1-1", "3-3", "0-2-1"])
def test_stiffness_does_not_depend_on_the_joints_without_gravity(name: str) -> None:
    arm = loaded(ARMS[name])
    p, code = arm_vector(arm), compiled(arm)
    places = [straight(random_state(arm, s)[0][: arm.joints], arm) for s in range(3)]
    some = [code.linear_matrices(q, p) for q in places]
    some += zip(*code.linear_matrices(np.array(places), np.array([p] * 3)), strict=True)
    assert all(np.array_equal(some[0][0], K) and np.array_equal(some[0][1], D) for K, D in some)
