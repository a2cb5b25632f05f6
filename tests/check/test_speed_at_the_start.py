"""How fast a joint moves when a recording begins."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from flexgui.core.check.case import Case
from flexgui.core.check.checks.starts_moving import StartsMoving
from flexgui.core.check.measured_recording import MeasuredRecording
from tests.check.test_faults import SIZE

STEP, COUNT, HOLD = 1e-3, 400, 20
SPEED = 0.42
"""rad/s, of a joint that overshoots its reference of 0.3 rad/s."""
SHARE, NOISE = 0.3, 1e-7
"""Of the way to its speed that a joint goes in a sample; rad."""


@pytest.mark.parametrize("left", [2, 4, 10])
def test_the_speed_at_the_start_is_that_before_the_next_step_of_a_reference(left: int) -> None:
    """A fast loop turns the joint around within some samples, `left` samples after the first."""
    sides = np.where(np.arange(COUNT) // HOLD % 2, 1.0, -1.0)
    speed = lfilter([SHARE], [1.0, SHARE - 1.0], SPEED * sides)
    noise = NOISE * np.random.default_rng(left).standard_normal(COUNT)
    place = np.r_[0.0, np.cumsum(speed[:-1] * STEP)] + noise
    cut = slice(5 * HOLD - left, None)
    channels = {"theta1": place[cut], "dtheta1_ref": 0.3 * sides[cut]}
    found = MeasuredRecording("cut", "estimate", STEP * np.arange(COUNT)[cut], channels)
    (one,) = StartsMoving().find(Case(found))
    assert one.channel == "theta1"
    assert one.size == pytest.approx(speed[cut][0], rel=SIZE)
