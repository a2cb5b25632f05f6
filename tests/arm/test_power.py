"""Forces and energies belong together, at any bent state of any arm."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from flexgui.core.arm.arm import Structure
from flexgui.core.arm.kinematics import Kinematics, components
from flexgui.core.arm.slots import LENGTH, MASS, TIP_MASS, arm_vector
from tests.helpers import ARMS, EVERY_ARM, compiled, jacobian, loaded, random_state

BALANCE = 1e-8
"""Relative to the power's parts: differences of fourth order lose about half the digits."""

STEP = 1e-4
GRAVITY = (1.3, -9.81)


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


@pytest.mark.parametrize("name", EVERY_ARM)
def test_gravity_does_no_work_over_a_closed_path(name: str) -> None:
    """Its force has a potential, so the slope of the force is symmetric."""
    arm = loaded(ARMS[name])
    free, pulled = arm_vector(arm), arm_vector(loaded(ARMS[name], GRAVITY))
    code = compiled(arm)
    q, still = random_state(arm, 3)[0], np.zeros(arm.coordinates)

    def force(x: np.ndarray) -> np.ndarray:
        return code.mass_and_force(x, still, pulled)[1] - code.mass_and_force(x, still, free)[1]

    slope = jacobian(force, q)
    assert np.abs(slope - slope.T).max() < BALANCE * max(np.abs(slope).max(), 1.0)


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
