"""A torque rig whose recording comes from the model itself lacks nothing, whatever the filter."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.arm.presets import presets
from flexgui.core.drives.servo import FollowingServo, hold_mean
from flexgui.core.drives.torque import Torque
from flexgui.core.identify.predictor import motion_of
from flexgui.core.identify.prepared_recording import Prepared, prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.model import Model
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.velocity import ZeroPhaseLowPass
from flexgui.core.sensors import sensor
from flexgui.core.simulate.nonlinear import simulate_within
from tests.helpers import from_rest, read

BENCH = presets()["two_stage_bench"]
INERTIA = (0.35, 0.0095)
STEP, SAMPLES = 1e-3, 1200

TORQUE = 0.05
"""Of the torque's rms: what was before the first sample is not known, and a filter of 40 Hz brings
it into the recording; 0.01 from 80 Hz on."""

BENDING = 1e-3
"""Of the deflections' rms; a start that was half a sample late left a fifth."""


def recording() -> Recording:
    """The bench under torques that jump, held by their drive from sample to sample."""
    model = Model(BENCH, Torque(), "nonlinear")
    rng = np.random.default_rng(3)
    levels = rng.choice([-1.0, 1.0], (SAMPLES // 66 + 1, 2)) * np.array([1.0, 0.05])
    torque = np.repeat(levels, 66, axis=0)[:SAMPLES]
    task = from_rest(model, [0.2, -0.4], torque, STEP)
    motion = simulate_within(model, model.numbers(), task, 1e-9).trajectory
    return read(model, task, motion, "encoder", "deflection")


def missing(cutoff: float | None) -> tuple[Prepared, np.ndarray]:
    """What is compared, and its error over the rms of what was measured, per channel."""
    one = None if cutoff is None else ZeroPhaseLowPass(cutoff_hz=cutoff)
    servo = FollowingServo(Torque(), 60.0, INERTIA)
    model = Model(BENCH, Torque(), "nonlinear").steered_by(servo)
    outputs = [sensor("torque"), sensor("deflection")]
    e = prepare(model, recording(), outputs, Processing(one))
    found = e.predicted(motion_of(e, model.numbers(), {}, 4), model.numbers(), {})
    apart = np.where(e.counted, found - e.measured, 0.0)
    return e, np.sqrt(np.mean(apart**2, axis=0) / np.mean(e.measured**2, axis=0))


@pytest.mark.parametrize("cutoff", [None, 40.0, 80.0])
def test_a_torque_rig_that_is_the_model_lacks_nothing(cutoff: float | None) -> None:
    e, error = missing(cutoff)
    assert e.task.before is not None
    assert np.all(error[:2] < TORQUE)
    assert np.all(error[2:] < BENDING)


def test_a_held_signal_is_seen_half_a_sample_late() -> None:
    ramp = np.arange(6.0)[:, None]
    assert hold_mean(ramp)[1:, 0] == pytest.approx(ramp[1:, 0] - 0.5)
    assert hold_mean(np.full((4, 1), 2.0)) == pytest.approx(2.0)
