"""A recording's bending is drawn so large that it is seen, and not larger."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.arm.slots import arm_vector
from flexgui.scene.arm_geometry import ArmGeometry
from flexgui.scene.recorded_motion import FACTORS, SHARE, fitting_factor, largest_deflection
from tests.helpers import PAPER, random_state

STEP = 1.6
"""Between a factor and what would be exact: half a step of 1, 2, 5, 10 is at most sqrt(2.5)."""

P = arm_vector(PAPER)
REACH = ArmGeometry(PAPER, P).reach


def bent(by: float) -> np.ndarray:
    """(5, n) postures whose bending is about `by`."""
    return np.array([random_state(PAPER, seed, bend=by)[0] for seed in range(5)])


@pytest.mark.parametrize("by", [0.003, 0.006, 0.012, 0.03, 0.08])
def test_the_largest_deflection_is_drawn_at_a_share_of_the_reach(by: float) -> None:
    q = bent(by)
    drawn = fitting_factor(PAPER, P, q) * largest_deflection(PAPER, P, q) / REACH
    least, most = FACTORS[0], FACTORS[-1]
    if least < fitting_factor(PAPER, P, q) < most:
        assert SHARE / STEP <= drawn <= SHARE * STEP


def test_a_larger_bending_is_not_exaggerated_more() -> None:
    factors = [fitting_factor(PAPER, P, bent(by)) for by in (1e-6, 1e-3, 1e-2, 1e-1, 1.0)]
    assert factors == sorted(factors, reverse=True)
    assert set(factors) <= set(FACTORS)


def test_what_does_not_bend_is_drawn_as_it_is() -> None:
    straight = bent(0.01)
    straight[:, PAPER.joints :] = 0.0
    assert fitting_factor(PAPER, P, straight) == 1.0
    assert fitting_factor(PAPER, P, straight[:0]) == 1.0


def test_frames_without_numbers_do_not_matter() -> None:
    assert fitting_factor(PAPER, P, np.full((3, PAPER.coordinates), np.nan)) == 1.0
