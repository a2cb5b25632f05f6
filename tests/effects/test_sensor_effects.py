"""What delays, lags, turned cameras and shifted encoders make of a motion."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lsim

from flexgui.core.arm.presets import presets
from flexgui.core.drives.servo import FollowingServo
from flexgui.core.drives.torque import Torque
from flexgui.core.effects import Rig, effect
from flexgui.core.effects.sizes import typical
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.model import Model
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.sensors import sensor, sensors
from flexgui.core.simulate.experiment import simulate_recording
from flexgui.core.simulate.nonlinear import simulate_within
from tests.effects.helpers import experiment
from tests.helpers import PAPER, chain, looped

DT = 1e-3
T = np.arange(400) * DT
ROUNDING = 1e-12

SPLINE = 1e-6
"""Of a vibration of 10 Hz sampled at 1 kHz: the spline's error is about (w dt)^4 / 384."""


def sensed(kind: str, sensor: str, y: np.ndarray, **values: float) -> np.ndarray:
    return effect(kind).sensed(sensor, y, DT, values)


def swinging(hz: float = 10.0, phase: float = 0.0) -> np.ndarray:
    """(N, 2), starting at rest."""
    w = 2.0 * np.pi * hz
    return np.column_stack([np.cos(w * (T - phase)), 2.0 * np.cos(w * (T - phase)) + 3.0])


@pytest.mark.parametrize("samples", [1, 7, 50])
def test_a_delay_of_whole_samples_moves_the_samples(samples):
    y = swinging()
    moved = sensed("camera_delay", "z", y, td=samples * DT)
    assert np.abs(moved[samples:] - y[:-samples]).max() < ROUNDING
    assert np.abs(moved[:samples] - y[0]).max() < ROUNDING


def test_a_delay_between_samples_moves_a_vibration_by_just_that_time():
    moved = sensed("camera_delay", "z", swinging(), td=0.0123)
    assert np.abs(moved - swinging(phase=0.0123))[20:].max() < SPLINE


def test_a_small_delay_takes_its_time_times_the_velocity():
    w, small = 2.0 * np.pi * 10.0, 1e-7
    slope = (sensed("camera_delay", "z", swinging(), td=small) - swinging()) / small
    expected = w * np.sin(w * T)
    assert np.abs(slope[5:-5, 0] - expected[5:-5]).max() < 1e-4 * w


@pytest.mark.parametrize("name", ["encoder", "deflection", "torque"])
def test_a_late_camera_delays_nothing_else(name):
    y = swinging()
    assert sensed("camera_delay", name, y, td=0.01) is y


@pytest.mark.parametrize("ts", [1e-4, 1e-3, 0.02, 0.3])
def test_a_lag_is_the_first_order_system_that_it_states(ts):
    y = swinging()
    _, expected, _ = lsim(([1.0], [ts, 1.0]), y[:, 0], T, X0=[ts * y[0, 0]], interp=True)
    assert np.abs(sensed("sensor_lag", "z", y, ts=ts)[:, 0] - expected).max() < 1e-10


def test_a_lag_leaves_what_rests_and_trails_a_ramp_by_its_time():
    y = np.column_stack([np.full_like(T, 5.0), T])
    found = sensed("sensor_lag", "deflection", y, ts=0.01)
    assert np.abs(found[:, 0] - 5.0).max() < ROUNDING
    assert found[-1, 1] == pytest.approx(T[-1] - 0.01, abs=1e-12)


def test_a_lag_vanishes_smoothly():
    y = swinging()
    errors = [np.abs(sensed("sensor_lag", "z", y, ts=ts) - y).max() for ts in (1e-5, 1e-6, 1e-9)]
    assert errors[1] == pytest.approx(0.1 * errors[0], rel=1e-3)
    assert errors[2] == pytest.approx(1e-4 * errors[0], rel=1e-3)


def test_a_turned_camera_turns_and_stretches_the_plane():
    y = swinging()
    found = sensed("camera_misalignment", "z", y, ca=0.3, cs=-0.1)
    plane = 0.9 * np.exp(0.3j) * (y[:, 0] + 1j * y[:, 1])
    assert np.abs(found[:, 0] + 1j * found[:, 1] - plane).max() < ROUNDING


def test_an_encoder_reads_its_offset_beside_the_true_angle():
    model = looped(PAPER).with_effects([effect("encoder_offset")], {"eo2": 0.05})
    recording = simulate_recording(model, SimulateSpec(theta2=1.0, seconds=0.2), "r")
    l1 = l2 = 0.5
    tip = l1 + l2 * np.exp(0.95j)
    assert recording["theta2"][0] == pytest.approx(1.0, abs=ROUNDING)
    assert recording["z1"][0] == pytest.approx(tip.real, abs=ROUNDING)
    assert recording["z2"][0] == pytest.approx(tip.imag, abs=ROUNDING)


@pytest.mark.parametrize(
    ("kind", "values"),
    [
        ("encoder_offset", {"eo2": 0.05}),
        ("camera_delay", {"td": 0.004}),
        ("sensor_lag", {"ts": 0.004}),
        ("camera_misalignment", {"ca": 0.01, "cs": 0.02}),
        ("sensor_delay", {"te1": 0.003, "tg2": 0.005}),
        ("sensor_gain", {"ge2": 0.02, "gg1": -0.4}),
    ],
)
def test_a_model_with_the_effect_predicts_the_recording_that_has_it(kind, values):
    model = looped(PAPER).with_effects([effect(kind)], values)
    recording = simulate_recording(model, SimulateSpec(theta2=1.0, seconds=0.3), "r")
    names = ("z", "y", "ydot", "encoder", "deflection", "torque")
    outputs = [sensor(name) for name in names]
    ready = prepare(model, recording, outputs, Processing())
    numbers = model.numbers()

    def miss(sizes: dict[str, float]) -> float:
        motion = simulate_within(model, numbers, ready.task_at(sizes)).trajectory
        return float(np.abs(ready.predicted(motion, numbers, sizes) - ready.measured).max())

    assert miss(dict(values)) < ROUNDING
    assert miss({name: 0.5 * value for name, value in values.items()}) > 1e-4


def rig(arm=PAPER, outputs=("z",), servo=False) -> Rig:
    return Rig(arm, looped(arm).drive, "nonlinear", outputs, servo)


@pytest.mark.parametrize(
    ("kind", "rigs", "words"),
    [
        ("camera_delay", rig(outputs=("encoder",)), "camera"),
        ("sensor_lag", rig(outputs=("encoder", "torque")), "strain gauge"),
        ("camera_misalignment", rig(outputs=("ydot",)), "tip positions"),
        ("camera_misalignment", rig(outputs=("encoder",)), "camera"),
        ("encoder_offset", rig(arm=chain(1)), "one joint"),
        ("encoder_offset", rig(servo=True), "encoders' positions"),
        ("sensor_delay", rig(outputs=("z",)), "camera has its own"),
        ("sensor_gain", rig(outputs=("ydot",)), "camera has its own"),
    ],
)
def test_what_a_rig_cannot_show_is_said(kind, rigs, words):
    assert words in effect(kind).not_applicable(rigs)


SLIDE = presets()["single_axis"]

FOLLOWED = 0.02
"""Of the torque that a wrong encoder makes the servo give; the servo is of finite stiffness."""


@pytest.mark.parametrize(("name", "own"), [("encoder", "e"), ("deflection", "g"), ("torque", "u")])
def test_one_late_channel_moves_alone_and_later(name, own):
    y = swinging()
    found = sensed("sensor_delay", name, y, **{f"t{own}1": 0.0, f"t{own}2": 0.0123})
    assert np.array_equal(found[:, 0], y[:, 0])
    assert np.abs(found - swinging(phase=0.0123))[20:, 1].max() < 2.0 * SPLINE


def test_a_channel_may_be_early():
    y = np.column_stack([np.sin(9.0 * T), np.sin(9.0 * T)])
    found = sensed("sensor_delay", "encoder", y, te1=-0.004, te2=0.0)
    assert np.abs(found[:-10, 0] - np.sin(9.0 * (T[:-10] + 0.004))).max() < SPLINE


@pytest.mark.parametrize(("name", "own"), [("encoder", "e"), ("deflection", "g"), ("torque", "u")])
def test_a_gain_of_minus_four_tenths_reads_six_tenths(name, own):
    y = swinging()
    found = sensed("sensor_gain", name, y, **{f"g{own}1": -0.4, f"g{own}2": 0.0})
    assert np.allclose(found, y * [0.6, 1.0], rtol=ROUNDING)


@pytest.mark.parametrize("kind", ["sensor_delay", "sensor_gain"])
@pytest.mark.parametrize("name", ["z", "y", "ydot"])
def test_the_camera_is_left_to_its_own_effects(kind, name):
    y, letter = swinging(), {"sensor_delay": "t", "sensor_gain": "g"}[kind]
    assert sensed(kind, name, y, **{f"{letter}{own}1": 0.01 for own in "egu"}) is y


def test_the_gain_of_an_encoder_says_where_the_joints_are():
    model = looped(PAPER).with_effects([effect("sensor_gain")], {"ge2": 0.25})
    recording = simulate_recording(model, SimulateSpec(theta2=1.0, seconds=0.1), "r")
    tip = 0.5 + 0.5 * np.exp(0.8j)
    assert recording["theta2"][0] == pytest.approx(1.0, abs=ROUNDING)
    assert complex(recording["z1"][0], recording["z2"][0]) == pytest.approx(tip, abs=ROUNDING)


def rig_with(outputs=("z", "encoder"), servo=False, arm=PAPER, drive=None) -> Rig:
    return Rig(arm, drive or looped(arm).drive, "nonlinear", outputs, servo)


@pytest.mark.parametrize("kind", ["sensor_delay", "sensor_gain"])
@pytest.mark.parametrize(
    ("where", "letters"),
    [
        (rig_with(), "e"),
        (rig_with(outputs=("encoder", "deflection")), "eg"),
        (rig_with(outputs=("encoder", "torque")), "eu"),
        (rig_with(outputs=("torque",), servo=True), "e"),
        (rig_with(outputs=("torque", "deflection"), servo=True), "eg"),
        (rig_with(outputs=("torque", "link_encoder"), servo=True), "el"),
        (rig_with(outputs=("encoder", "torque"), drive=Torque()), "e"),
    ],
)
def test_only_what_the_rig_compares_can_be_late_or_scaled(kind, where, letters):
    one = effect(kind)
    assert not one.not_applicable(where)
    names = [k.parameter.name for k in one.parameters(PAPER, where.drive, typical(PAPER))]
    assert {name[1] for name in names if one.shown(name, where)} == set(letters)
    own = [one for one in sensors().values() if not one.from_camera]
    assert len(names) == sum(len(s.channels(PAPER)) for s in own if s.defined_on(PAPER))


def test_a_rigid_segment_has_no_gauge():
    names = [k.parameter.name for k in effect("sensor_gain").parameters(SLIDE, Torque(), None)]
    assert sorted(names) == ["ga1", "ge1", "gl1", "gu1", "gw1"]


@pytest.mark.parametrize(
    ("kind", "values"), [("sensor_delay", {"te1": 0.003}), ("sensor_gain", {"ge1": 0.1})]
)
def test_a_servo_follows_the_joint_and_not_its_wrong_encoder(kind, values):
    """A late or scaled encoder asks for another torque; the effect takes that away again."""
    truth = Model(SLIDE, Torque())
    rig = truth.with_effects([effect(kind)], values)
    spec = SimulateSpec(seconds=0.6, amplitude=200.0, hold=0.05)
    servo = FollowingServo(Torque(), 60.0, (SLIDE.segments[0].mass,))

    def missing(model: Model, recorded: Model) -> np.ndarray:
        recording = simulate_recording(recorded, spec, "r")
        ready = prepare(model.steered_by(servo), recording, [sensor("torque")], Processing())
        numbers = ready.model.numbers()
        motion = simulate_within(ready.model, numbers, ready.task_at({})).trajectory
        return (ready.predicted(motion, numbers, {}) - ready.measured)[20:-20]

    least = missing(truth, truth)
    wrong, put_back = missing(truth, rig) - least, missing(rig, rig) - least
    assert np.sqrt(np.mean(put_back**2)) < FOLLOWED * np.sqrt(np.mean(wrong**2))


def test_the_delay_under_a_servo_is_an_unknown_like_any_other():
    model = Model(SLIDE, Torque()).with_effects([effect("sensor_delay")], {"te1": 0.003})
    servo = FollowingServo(Torque(), 60.0, (SLIDE.segments[0].mass,))
    recording = simulate_recording(model, SimulateSpec(seconds=0.2, amplitude=200.0), "r")
    ready = prepare(model.steered_by(servo), recording, [sensor("torque")], Processing())
    at = [ready.task_at({"te1": x}).references for x in (0.0, 0.003)]
    task = experiment(model, None, seconds=0.2, amplitude=200.0)
    assert np.array_equal(task.references[:, 0], recording["u1"])
    place = simulate_within(model, model.numbers(), task).trajectory
    assert np.abs(at[1][10:-10, -2] - place.joint_positions[10:-10, 0]).max() < 1e-6
    assert np.array_equal(at[0][:, -2], recording["theta1"])


@pytest.mark.parametrize("moving", [False, True])
def test_what_is_late_shows_how_a_recording_that_begins_in_motion_came_there(moving: bool) -> None:
    """A camera stood still before the first sample, and the whole recording was not explained."""
    model = looped(PAPER).with_effects([effect("camera_delay")], {"td": 0.01})
    dt, speeds = 1e-3, np.array([0.3, -2.0])
    y = 1.0 + np.arange(300)[:, None] * dt * speeds
    before = np.arange(300)[:, None] * dt - 0.01
    true = 1.0 + (before if moving else np.maximum(before, 0.0)) * speeds
    assert model.sensed("z", y, dt, {}, moving) == pytest.approx(true, abs=ROUNDING)
