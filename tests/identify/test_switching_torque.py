"""A light motor that switches faster than its link swings: nothing of it is left in the torque."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.segment import Segment
from flexgui.core.drives.servo import FollowingServo
from flexgui.core.drives.torque import Torque
from flexgui.core.identify.predictor import motion_of
from flexgui.core.identify.prepared_recording import Prepared, prepare
from flexgui.core.identify.prescribed_joint_motion import (
    points_per_sample,
    prescribed_motion,
    sampling_warning,
)
from flexgui.core.identify.processing import Processing
from flexgui.core.model import Model
from flexgui.core.noise.noise_floor import REFUTED, channel_floors
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.velocity import ZeroPhaseLowPass
from flexgui.core.sensors import sensor
from flexgui.core.simulate.nonlinear import simulate_within
from tests.helpers import from_rest, rms

LINK = Arm(segments=(Segment(length=0.46, mass=3.5, EI=545.0, hub_inertia=0.04, modes=1),))
STEP, SAMPLES, HOLD = 2e-3, 500, 5
"""s; its vibration lasts ten samples, and the torque may switch in every fifth."""

RARELY = 2.0 * STEP
"""s; where a vibration lasts five samples, straight accelerations between them left 0.027 of the
torque."""

PROCESSING = Processing(ZeroPhaseLowPass(cutoff_hz=30.0))

LEFT = 0.01
"""Of the torque's rms; a spline that knew nothing of the jumps left 0.03, and a filter of the
places before they are differentiated 0.2 near their ends."""

COUNT = 1.2e-5
"""rad, of an encoder of 2^19 steps"""


DRAWS = 10
"""Of the encoder's steps: its link swings with them for the whole recording, so one may leave a
third of what another does, and each has a floor of its own."""

ROUNDING = 1e-9


def recording(count: float, turned: float = 0.0, step: float = STEP) -> Recording:
    """`turned` by how much the encoder's marks lie elsewhere, in counts; `step` in s."""
    rng = np.random.default_rng(5)
    torque = 8.6 * np.repeat(rng.choice([-1.0, 1.0], SAMPLES // HOLD), HOLD)[:, None]
    model = Model(LINK, Torque(), "nonlinear")
    task = from_rest(model, [-0.2], torque, step)
    place = simulate_within(model, model.numbers(), task, 1e-9).trajectory.joint_positions[:, 0]
    place = count * (np.round(place / count + turned) - turned) if count else place
    return Recording("r", task.time, {"u1": torque[:, 0], "theta1": place})


def prepared(count: float, turned: float = 0.0, step: float = STEP) -> Prepared:
    model = Model(LINK, Torque(), "nonlinear")
    servo = FollowingServo(Torque(), 60.0, (0.29,))
    return prepare(
        model.steered_by(servo), recording(count, turned, step), [sensor("torque")], PROCESSING
    )


def missing(e: Prepared) -> np.ndarray:
    """(M,) of the samples that count."""
    numbers = e.model.numbers()
    apart = e.predicted(motion_of(e, numbers, {}, 4), numbers, {}) - e.measured
    return np.asarray(apart[e.counted])


@pytest.mark.parametrize("step", [STEP, RARELY])
def test_the_whole_model_leaves_nothing(step: float) -> None:
    e = prepared(0.0, step=step)
    assert rms(missing(e)) < LEFT * rms(e.measured)


def test_what_a_led_arm_swings_by_itself_counts_though_the_free_vibration_does_not_show() -> None:
    """At 200 Hz a rig whose free vibration of 95 Hz was filtered out left 1.5 % of its torque: with
    the joints led it swings at 45 Hz."""
    model, servo = prepared(0.0, step=RARELY).model, prepared(0.0, step=RARELY).model.steering
    seldom = 1.6 * RARELY
    free_hz, led_hz = 1.628 / (2.0 * np.pi * RARELY), 0.715 / (2.0 * np.pi * RARELY)
    between = replace(servo, band_hz=0.5 * (free_hz + led_hz))
    below = replace(servo, band_hz=0.9 * led_hz)
    assert points_per_sample(model.steered_by(between), seldom) == 2
    assert points_per_sample(model.steered_by(below), seldom) == 1


def test_a_rig_whose_samples_hardly_show_its_vibration_is_told() -> None:
    """50 Hz: 1.6 rad from one sample to the next, and 2.6 at five eighths of the rate."""
    model = prepared(0.0, step=RARELY).model
    assert sampling_warning(model, RARELY) == ""
    said = sampling_warning(model, 1.6 * RARELY)
    hz = 1.62769616 / (2.0 * np.pi * RARELY)
    assert f"about {hz:.0f} Hz" in said and said.endswith("Hz or more.")


SCATTER = 2.5
"""Of six draws through a link that is hardly damped, their upper quantile over the quietest, which
alone can be refuted."""


@pytest.mark.parametrize("turned", np.linspace(0.0, 0.9, DRAWS))
def test_motion_passes_for_noise_only_where_the_model_does_not_refute_it(turned: float) -> None:
    """What the encoder reads beyond a low-pass is motion; only the missing torque has it not. An
    estimate far above what the model leaves is none."""
    e = prepared(COUNT, turned)
    numbers = e.model.numbers()
    motion = motion_of(e, numbers, {}, 4)
    error = e.measured - e.predicted(motion, numbers, {})
    found = channel_floors([e], [error], [(motion, numbers, {})], {}, 0.0)["u1"]
    assert found.source == "estimated"
    left = rms(missing(e))
    if found.refuted is None:
        assert found.noise <= SCATTER * REFUTED * left
    else:
        assert found.refuted > REFUTED * left
        assert found.noise == pytest.approx(left, rel=ROUNDING)


def test_a_smoothed_motion_has_no_jumps() -> None:
    """The places have lost what is faster than the compared torques; a motion through them with the
    jumps of a current that was logged, not held, swung a light link by radians."""
    e = prepared(COUNT)
    slow = replace(e.model.servo, torque_hz=20.0)
    smooth = prepare(e.model.steered_by(slow), e.recording, e.outputs, PROCESSING)
    motion = prescribed_motion(smooth.model, smooth.model.numbers(), smooth.task)
    assert not motion.held.any()
    assert rms(motion.speed) < 1.1 * rms(smooth.model.servo.motion(e.recording, LINK).speed)
    assert prescribed_motion(e.model, e.model.numbers(), e.task).held.any()
