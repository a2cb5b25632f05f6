"""How fast a joint moves when a recording begins."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.check.case import Case
from flexgui.core.check.checks.starts_moving import StartsMoving
from flexgui.core.check.measured_recording import MeasuredRecording
from tests.check.test_faults import SIZE

STEP, COUNT, HOLD = 1e-3, 400, 20
SPEED = 0.42
"""rad/s, of a joint that overshoots its reference of 0.3 rad/s."""


@pytest.mark.parametrize("left", [1, 2, 4, 10])
def test_the_speed_at_the_start_is_that_before_the_next_step_of_a_reference(left: int) -> None:
    """A fast loop turns the joint around within a sample, `left` samples after the first."""
    sides = np.where(np.arange(COUNT) // HOLD % 2, 1.0, -1.0)[HOLD - left :]
    place = np.r_[0.0, np.cumsum(SPEED * sides[:-1] * STEP)]
    channels = {"theta1": place, "dtheta1_ref": 0.3 * sides}
    found = MeasuredRecording("cut", "estimate", STEP * np.arange(len(sides)), channels)
    (one,) = StartsMoving().find(Case(found))
    assert one.channel == "theta1" and one.size == pytest.approx(-SPEED, rel=SIZE)
