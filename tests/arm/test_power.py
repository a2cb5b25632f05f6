"""Forces and energies belong together, at any bent state of any arm."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.arm.slots import arm_vector
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
