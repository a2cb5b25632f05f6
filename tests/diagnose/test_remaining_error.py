"""Noise is what no channel stands out of: a quiet channel does not hide another one."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flexgui.core.diagnose.remaining_error import within_noise
from flexgui.core.results import ABOVE, ABOVE_IN_ONE

SAMPLES = 1000


def data(servo: bool = False) -> Any:
    counted = np.ones((SAMPLES, 2), dtype=bool)
    one = SimpleNamespace(channels=[("z1", "m"), ("theta1", "rad")], counted=counted)
    return SimpleNamespace(
        experiments=[one], count=2 * SAMPLES, rig=SimpleNamespace(servo=servo), law_errors={}
    )


def left(z: float, theta: float) -> list[np.ndarray]:
    """Errors of two channels with these rms, in noise floors."""
    return [np.tile([z, theta], (SAMPLES, 1)) * np.resize([1.0, -1.0], SAMPLES)[:, None]]


@pytest.mark.parametrize("servo, z, within", [
    (False, 0.95, True), (False, 1.03, False), (True, 1.03, True), (True, ABOVE + 0.02, False),
])  # fmt: skip
def test_a_servo_has_the_limit_of_the_verdict_others_the_noise_itself(
    servo: bool, z: float, within: bool
) -> None:
    assert within_noise(data(servo), left(z, z)) is within


@pytest.mark.parametrize("servo", [False, True])
def test_a_channel_that_stands_out_is_not_hidden_by_a_quiet_one(servo: bool) -> None:
    assert within_noise(data(servo), left(0.5, ABOVE_IN_ONE - 0.01))
    assert not within_noise(data(servo), left(0.5, ABOVE_IN_ONE + 0.01))


def test_a_simulation_that_went_astray_is_no_noise() -> None:
    assert not within_noise(data(), [np.full((SAMPLES, 2), np.inf)])
