"""Joints that stand still, and what unknown friction there adds to a torque."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.drives.servo import FollowingServo
from flexgui.core.drives.torque import Torque
from flexgui.core.identify.processing import TORQUE, Processing
from flexgui.core.identify.standstill import Standstill, standstills
from flexgui.core.recording.recording import Recording

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


RESTS = (slice(700, 800), slice(850, 950), slice(2000, 2300))
"""Samples: the answers of the first two, which a servo filters, overlap."""
SERVO = FollowingServo(Torque(), 60.0, (0.3,))
ROUNDING = 1e-6
"""Of a force of one or two: the square root of the rounding, by which the projection is damped."""
COUNTED = np.ones((N, 1), dtype=bool)
COUNTED[750:760] = False


def resting() -> Standstill:
    """A joint that moves steadily, and stops now and then."""
    moves = np.ones(N)
    for at in RESTS:
        moves[at] = 0.0
    moves = np.convolve(moves, np.hanning(40) / np.hanning(40).sum(), mode="same")
    place = np.cumsum(moves) * DT + NOISE * np.random.default_rng(4).standard_normal(N)
    recording = Recording("r", DT * np.arange(N), {"theta1": place, "torque1": np.zeros(N)})
    return Standstill(SERVO, recording, Processing(), (TORQUE,), COUNTED)


def seen(friction: np.ndarray) -> np.ndarray:
    """(N, 1) what a torque shows of a friction (N,)."""
    return np.where(COUNTED, SERVO.response(friction[:, None], DT), 0.0)


def held_within(rests: list[slice]) -> np.ndarray:
    """(N,) levels and trends well inside some rests."""
    rng, friction = np.random.default_rng(7), np.zeros(N)
    for at in rests:
        inner = slice(at.start, at.stop)
        friction[inner] = np.polyval(rng.standard_normal(2), np.linspace(-1, 1, at.stop - at.start))
    return friction


def test_friction_at_standstill_leaves_no_error() -> None:
    still = resting()
    found = standstills(still.recording["theta1"], DT, SERVO.hz)
    assert len(found) == len(RESTS), found
    left = still.removed_from(seen(held_within(found)))
    assert np.abs(left).max() < ROUNDING


def test_what_is_far_from_every_standstill_stays() -> None:
    friction = np.zeros(N)
    friction[1300:1500] = 1.0
    assert resting().removed_from(seen(friction)) == pytest.approx(seen(friction), abs=ROUNDING)


def test_removed_twice_is_removed_once() -> None:
    error = np.where(COUNTED, np.random.default_rng(1).standard_normal((N, 1)), 0.0)
    once = resting().removed_from(error)
    assert resting().removed_from(once) == pytest.approx(once, abs=ROUNDING)
    assert np.sum(once * (error - once)) == pytest.approx(0.0, abs=ROUNDING * N)


def test_without_a_servo_nothing_is_removed() -> None:
    error = np.ones((N, 1))
    plain = Standstill(None, resting().recording, Processing(), (TORQUE,), COUNTED)
    assert plain.removed_from(error) is error
