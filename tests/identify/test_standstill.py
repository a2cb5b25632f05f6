"""Where an encoder shows that its joint stands still."""

from __future__ import annotations

import numpy as np

from flexgui.core.identify.standstill import standstills

DT, N, HZ = 1e-3, 3000, 100.0
"""s, samples, and the highest compared frequency"""
NOISE = 1e-5
"""rad"""


def swing(rest: int) -> np.ndarray:
    """(N,) rad of a joint that turns round in its middle, and rests there for so many samples."""
    time = DT * np.clip(np.abs(np.arange(N) - N // 2) - rest // 2, 0, None)
    noise = NOISE * np.random.default_rng(4).standard_normal(N)
    return np.asarray(np.cos(4.0 * time) + noise)


def test_a_joint_that_rests_before_it_turns_round_stands_still_then() -> None:
    (found,) = standstills(swing(60), DT, HZ)
    assert abs(found.start - (N // 2 - 30)) < 10 and abs(found.stop - (N // 2 + 30)) < 10


def test_a_joint_that_turns_round_at_once_does_not_stand_still() -> None:
    assert standstills(swing(0), DT, HZ) == []
