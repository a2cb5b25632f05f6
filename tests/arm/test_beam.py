"""A segment is an Euler-Bernoulli beam, and a base that turns is what it is by hand."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.arm.arm import Arm, Pedestal
from flexgui.core.arm.segment import Segment
from flexgui.core.arm.shapes import exponent
from flexgui.core.arm.slots import arm_vector
from tests.helpers import compiled

LENGTH, MASS, EI = 0.5, 7.5, 520.83


def bending_stiffness(modes: int) -> np.ndarray:
    """K of the modal coordinates of one segment whose joint is held."""
    return matrices(arm(modes, None))[1][1:, 1:]


@pytest.mark.parametrize("modes", [2, 3])
def test_static_tip_compliance_is_exact(modes: int) -> None:
    """delta(l) = F l^3 / 3 EI: the cubic that a tip force bends lies in the shapes' span.

    The shapes of two modes are the first two of three, so their stiffness is the leading block.
    """
    K = bending_stiffness(3)[:modes, :modes]
    reach = np.array([LENGTH ** exponent(i) for i in range(modes)])
    assert reach @ np.linalg.solve(K, reach) == pytest.approx(LENGTH**3 / (3 * EI), rel=1e-10)


def test_one_mode_stiffness_is_that_of_the_paper() -> None:
    """Bending energy 2 EI l v^2, so K = 4 EI l."""
    assert bending_stiffness(1)[0, 0] == pytest.approx(4 * EI * LENGTH, rel=1e-14)


HUB = 0.05
LINK = MASS * LENGTH**2 / 3.0
"""kg m², of a slender rod about its end."""
SPRING, COLUMN = 4000.0, 1.7
"""N m/rad and kg m²."""
NOTHING = 1e-9
"""kg m²: far below what else turns."""


def arm(modes: int, pedestal: Pedestal | None, compliance: float | None = None) -> Arm:
    """One link on a hub."""
    link = Segment(
        length=LENGTH, mass=MASS, modes=modes, hub_inertia=HUB, joint_compliance=compliance,
        EI=EI if modes else None,
    )  # fmt: skip
    return Arm(segments=(link,), pedestal=pedestal)


def matrices(of: Arm) -> tuple[np.ndarray, np.ndarray]:
    """Mass and stiffness at rest."""
    code, p, q = compiled(of), arm_vector(of), np.zeros(of.coordinates)
    return code.mass_matrix(q, p), code.linear_matrices(q, p)[0]


def test_a_rigid_link_turns_with_its_base() -> None:
    M, K = matrices(arm(0, Pedestal(compliance=1.0 / SPRING, inertia=COLUMN)))
    assert pytest.approx(np.array([[LINK + HUB, LINK], [LINK, LINK + COLUMN]])) == M
    assert pytest.approx(np.diag([0.0, SPRING])) == K


def test_a_base_without_inertia_is_an_elastic_joint() -> None:
    base = matrices(arm(2, Pedestal(compliance=1.0 / SPRING, inertia=NOTHING)))
    joint = matrices(arm(2, None, 1.0 / SPRING))
    for a, b in zip(base, joint, strict=True):
        assert a == pytest.approx(b, abs=2.0 * NOTHING)
