"""K = -dF/dq and D = -dF/dq' of the straight arm, against differences of the force itself."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.arm.slots import arm_vector
from tests.helpers import ARMS, EVERY_ARM, compiled, jacobian, loaded, random_state, straight

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
    some = [
        code.linear_matrices(straight(random_state(arm, s)[0][: arm.joints], arm), p)
        for s in range(3)
    ]
    assert all(np.array_equal(some[0][0], K) and np.array_equal(some[0][1], D) for K, D in some)
