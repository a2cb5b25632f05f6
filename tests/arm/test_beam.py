"""A segment is an Euler-Bernoulli beam."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.segment import Segment
from flexgui.core.arm.shapes import exponent
from flexgui.core.arm.slots import arm_vector
from tests.helpers import compiled

BETA_L = (1.8751040687, 4.6940911330)
"""Roots of cos(x) cosh(x) = -1, the clamped-free beam."""

FIRST, SECOND = 1e-3, 1e-2
"""How near three polynomials come to the first two frequencies, relative."""

LENGTH, MASS, EI = 0.5, 7.5, 520.83


def beam(modes: int) -> tuple[np.ndarray, np.ndarray]:
    """M and K of the modal coordinates of one segment whose joint is held."""
    arm = Arm(segments=(Segment(length=LENGTH, mass=MASS, EI=EI, modes=modes),))
    code, p, q = compiled(arm), arm_vector(arm), np.zeros(1 + modes)
    return code.mass_matrix(q, p)[1:, 1:], code.linear_matrices(q, p)[0][1:, 1:]


def clamped_frequencies(modes: int) -> np.ndarray:
    M, K = beam(modes)
    return np.sqrt(eigh(K, M, eigvals_only=True))


def exact_frequencies() -> np.ndarray:
    return np.square(BETA_L) * np.sqrt(EI / (MASS * LENGTH**3))


def test_three_modes_have_the_clamped_frequencies_of_a_beam() -> None:
    error = np.abs(clamped_frequencies(3)[:2] / exact_frequencies() - 1.0)
    assert error[0] < FIRST
    assert error[1] < SECOND


def test_frequencies_come_down_to_the_exact_one_with_more_modes() -> None:
    first = [clamped_frequencies(modes)[0] for modes in (1, 3)]
    assert first[0] > first[1] > exact_frequencies()[0]


@pytest.mark.parametrize("modes", [2, 3])
def test_static_tip_compliance_is_exact(modes: int) -> None:
    """delta(l) = F l^3 / 3 EI: the cubic that a tip force bends lies in the shapes' span.

    The shapes of two modes are the first two of three, so their stiffness is the leading block.
    """
    K = beam(3)[1][:modes, :modes]
    reach = np.array([LENGTH ** exponent(i) for i in range(modes)])
    assert reach @ np.linalg.solve(K, reach) == pytest.approx(LENGTH**3 / (3 * EI), rel=1e-10)


def test_one_mode_stiffness_is_that_of_the_paper() -> None:
    """Bending energy 2 EI l v^2, so K = 4 EI l."""
    assert beam(1)[1][0, 0] == pytest.approx(4 * EI * LENGTH, rel=1e-14)
