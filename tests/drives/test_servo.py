"""The following servo: a perfect model leaves it nothing to do, a missing torque it reveals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lsim

from flexgui.core.arm.chord import chord_matrix
from flexgui.core.drives import build_drive
from flexgui.core.drives.servo import DEFAULT_HZ, FollowingServo
from flexgui.core.drives.torque import Torque
from flexgui.core.errors import InputError
from flexgui.core.model import Model
from flexgui.core.recording.initial_motion import begins_at_rest
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.simulate.experiment import make_task, simulate_recording
from flexgui.core.simulate.motion import Task
from flexgui.core.simulate.nonlinear import simulate_within
from tests.helpers import PAPER, loaded, looped, simulate_fixed

IDLE = 0.05
"""Relative to the recorded torque: a torque that jumps with its held reference is read as
running straight between samples, and central differences round off the rates."""

SETTLING = 200
"""Samples: the recording starts with a jump, which no difference of positions can follow."""

TOLERANCE = 1e-8
"""rad: the servo multiplies errors of position by 10^6 N m/rad, so those of the default
tolerance would look like a missing torque of 1 N m."""

REVEALED = 1e-3
"""Relative: a constant torque has all the time to show; the double pole rings off first."""

SMOOTH = {
    "theta2": 1.2, "seconds": 1.0, "excitation": "multisine",
    "options": {"highest_hz": 5.0, "periods": 1},
}  # fmt: skip


def servo_torque(added: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The servo's torque (N, 2) and the recorded one, with `added` (2,) withheld from the model."""
    arm = loaded(PAPER)
    recording = simulate_recording(looped(arm), SimulateSpec(**SMOOTH), "r")
    inertia = (6.0, 1.5)
    servo = FollowingServo(Torque(), DEFAULT_HZ, inertia)
    model = Model(arm, Torque(), steering=servo)
    numbers = model.numbers()
    signals = servo.signals(recording, arm)
    signals[:, :2] -= added
    start, _ = make_task(looped(arm), SimulateSpec(**SMOOTH), "r")
    task = Task(recording.time, signals, start.start, start.schedule)
    motion = simulate_within(model, numbers, task, TOLERANCE).trajectory
    return motion.torque - signals[:, :2], np.column_stack([recording["u1"], recording["u2"]])


def test_servo_idles_where_the_model_is_perfect() -> None:
    own, recorded = servo_torque(np.zeros(2))
    idle, usual = own[SETTLING:].std(axis=0), recorded[SETTLING:].std(axis=0)
    assert np.all(idle < IDLE * usual)


def test_servo_supplies_a_torque_that_is_withheld() -> None:
    missing = np.array([2.0, -1.0])
    supplied = servo_torque(missing)[0] - servo_torque(np.zeros(2))[0]
    assert supplied[SETTLING:].mean(axis=0) == pytest.approx(missing, rel=REVEALED)


def test_servo_has_a_double_pole_at_its_frequency() -> None:
    place, speed = FollowingServo(Torque(), 60.0, (4.0, 1.0)).gains()
    for k, inertia in enumerate((4.0, 1.0)):
        poles = np.roots([inertia, speed[k, k], place[k, k]])
        assert poles == pytest.approx(-2.0 * np.pi * 60.0, rel=1e-6)


def test_recorded_torque_of_a_velocity_loop_is_its_law_along_the_measured_motion() -> None:
    arm, model = loaded(PAPER), looped(loaded(PAPER))
    recording = simulate_recording(model, SimulateSpec(**SMOOTH), "r")
    servo = FollowingServo(model.drive, DEFAULT_HZ, (4.0, 1.0))
    law = model.drive.law(arm, model.numbers().p, {})
    found = servo.recorded_torque(servo.recorded(recording, arm), arm, law)
    true = np.column_stack([recording["u1"], recording["u2"]])
    inner = slice(5, -5)
    assert (found - true)[inner].std() < IDLE * true.std()


def test_a_drive_that_sees_the_links_cannot_be_replayed() -> None:
    options = {"gains": [[1.0, 2.0, 3.0, 4.0]] * 2, "torque_constants": [1.0, 1.0]}
    servo = FollowingServo(build_drive("state_feedback", options), 60.0, (4.0, 1.0))
    with pytest.raises(InputError, match="state_feedback"):
        servo.law(PAPER, np.ones(18), {})


def test_the_response_lets_a_constant_through_from_the_first_sample() -> None:
    constant = np.full((50, 2), 3.0)
    assert SERVO.response(constant, RESPONSE_STEP) == pytest.approx(constant, rel=1e-12)


RESPONSE_STEP = 1e-3
RESPONSE_HZ = 20.0
SERVO = FollowingServo(Torque(), RESPONSE_HZ, (1.0,))

WAVE_EXACT = 1e-3
"""Of the amplitude: straight lines between samples lie (w dt)^2 / 12 beside a sine."""


@pytest.mark.parametrize("hz", [1.0, 10.0, 40.0])
def test_the_response_to_a_sine_is_that_of_the_double_pole(hz: float) -> None:
    t, w, s = np.arange(4000) * RESPONSE_STEP, 2.0 * np.pi * RESPONSE_HZ, 2j * np.pi * hz
    gain = (2.0 * w * s + w * w) / (s + w) ** 2
    found = SERVO.response(np.sin(2.0 * np.pi * hz * t)[:, None], RESPONSE_STEP)[:, 0]
    expected = np.imag(gain * np.exp(s * t))
    late = t > 2.0  # the start, at rest, has died away
    assert np.abs(found - expected)[late].max() < WAVE_EXACT * max(1.0, (hz / 10.0) ** 2)


DRAWS = 4000

MISTAKEN = 6e-3
"""Share of them: three joints, each once in a thousand, and three deviations of counting."""


@pytest.mark.parametrize("step", [0.0, 2.0, 12.0])
def test_encoders_of_an_arm_at_rest_are_seen_to_rest(step: float) -> None:
    """Whatever they count in, in units of the noise."""
    rng = np.random.default_rng(1)
    noise = rng.standard_normal((DRAWS, 12, 3)) + 50.0 * rng.uniform(size=(DRAWS, 1, 3))
    seen = np.round(noise / step) * step if step else noise
    assert np.mean([not begins_at_rest(place) for place in seen]) < MISTAKEN


@pytest.mark.parametrize("level", [0.0, 1.0])
def test_a_motion_from_rest_rests_and_one_under_way_or_of_few_samples_does_not(
    level: float,
) -> None:
    rng = np.random.default_rng(2)
    n = np.arange(12.0)[:, None]
    for _ in range(200):
        noise = level * rng.standard_normal((12, 1))
        still = rng.standard_normal((12, 1))
        assert begins_at_rest(30.0 * n**2 + noise) and begins_at_rest(noise)
        assert not begins_at_rest((30.0 * n**2 + noise)[:5])
        assert not begins_at_rest(30.0 * n + noise)
        assert not begins_at_rest(np.hstack([30.0 * n + noise, still]))


def test_a_vibration_between_two_samples_hides_the_rest_in_one_joint_only() -> None:
    """Counts of encoders of an arm of three joints after a jump of the torque, at 250 Hz."""
    seen = [
        [0, 0, 0], [-212, 1, -48], [-429, 409, -226], [-732, 1127, -405], [-955, 2019, -391],
        [-1146, 2633, -145], [-1367, 2739, 45], [-1601, 2438, -232], [-1860, 2100, -400],
    ]  # fmt: skip
    assert begins_at_rest(np.array(seen, dtype=float))


AGREEMENT = 1e-4
"""Relative to the largest torque: SciPy is told the motion at 0.1 ms, straight in between."""

W, GAUGE, ZETA = 300.0, 200.0, 0.7
GAINS = np.array([[50.0, 80.0, 3.0, 5.0], [30.0, 50.0, 2.0, 2.0]])
CONSTANTS = np.array([1.5, 0.8])


def test_filtered_state_feedback_is_its_block_diagram() -> None:
    drive = build_drive(
        "state_feedback",
        {
            "gains": GAINS.tolist(),
            "torque_constants": CONSTANTS.tolist(),
            "rate_filter": W,
            "gauge_filter": {"frequency": GAUGE, "damping": ZETA},
        },
    )
    model = Model(PAPER, drive)
    spec = SimulateSpec(
        theta2=1.2, seconds=0.3, sample_time=1e-4, excitation="multisine", amplitude=0.02,
        options={"highest_hz": 20.0, "periods": 1},
    )  # fmt: skip
    task, _ = make_task(model, spec, "r")
    motion = simulate_fixed(model, model.numbers(), task, 4)
    t, start = task.time, task.start[:2]
    angle, bend = motion.q[:, :2], motion.q @ chord_matrix(PAPER, motion.p).T
    low_pass = ([GAUGE**2], [1.0, 2.0 * ZETA * GAUGE, GAUGE**2])
    low_pass_rate = ([GAUGE**2, 0.0], low_pass[1])
    expected = np.empty_like(motion.torque)
    for k in range(2):
        rate = lsim(([W, 0.0], [1.0, W]), angle[:, k] - start[k], t)[1]
        seen = lsim(low_pass, bend[:, k], t)[1]
        seen_rate = lsim(low_pass_rate, bend[:, k], t)[1]
        x = (task.references[:, k] - angle[:, k], -seen, -rate, -seen_rate)
        expected[:, k] = CONSTANTS[k] * GAINS[k] @ np.array(x)
    size = np.abs(expected).max(axis=0)
    assert np.all(np.abs(motion.torque - expected).max(axis=0) < AGREEMENT * size)
