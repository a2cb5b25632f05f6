"""A base that turns: by hand for one rigid link, and as an elastic joint without inertia."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.arm.arm import Arm, Pedestal, Structure
from flexgui.core.arm.compiled import compile_arm
from flexgui.core.arm.segment import Segment
from flexgui.core.arm.slots import arm_vector

LENGTH, MASS, HUB = 0.8, 3.0, 0.05
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
        EI=300.0 if modes else None,
    )  # fmt: skip
    return Arm(segments=(link,), pedestal=pedestal)


def matrices(of: Arm) -> tuple[np.ndarray, np.ndarray]:
    """Mass and stiffness at rest."""
    compiled, p, q = compile_arm(Structure.of(of)), arm_vector(of), np.zeros(of.coordinates)
    return compiled.mass_matrix(q, p), compiled.linear_matrices(q, p)[0]


def test_a_rigid_link_turns_with_its_base() -> None:
    M, K = matrices(arm(0, Pedestal(compliance=1.0 / SPRING, inertia=COLUMN)))
    assert pytest.approx(np.array([[LINK + HUB, LINK], [LINK, LINK + COLUMN]])) == M
    assert pytest.approx(np.diag([0.0, SPRING])) == K


def test_a_base_without_inertia_is_an_elastic_joint() -> None:
    base = matrices(arm(2, Pedestal(compliance=1.0 / SPRING, inertia=NOTHING)))
    joint = matrices(arm(2, None, 1.0 / SPRING))
    for a, b in zip(base, joint, strict=True):
        assert a == pytest.approx(b, abs=2.0 * NOTHING)
