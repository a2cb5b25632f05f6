"""One channel that is late, or has a wrong scale, beside others that are right."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.arm.presets import presets
from flexgui.core.drives.servo import FollowingServo
from flexgui.core.drives.torque import Torque
from flexgui.core.effects import Rig, effect
from flexgui.core.effects.sizes import typical
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.model import Model
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.sensors import sensor
from flexgui.core.simulate.experiment import simulate_recording
from flexgui.core.simulate.nonlinear import simulate_within
from tests.effects.helpers import experiment
from tests.effects.test_sensor_effects import DT, SPLINE, T, sensed, swinging
from tests.helpers import PAPER, looped

ROUNDING = 1e-12
SLIDE = presets()["single_axis"]

FOLLOWED = 0.02
"""Of the torque that a wrong encoder makes the servo give; the servo is of finite stiffness."""


@pytest.mark.parametrize("name", ["z", "y", "ydot", "encoder", "deflection", "torque"])
@pytest.mark.parametrize(("kind", "letter"), [("sensor_delay", "t"), ("sensor_gain", "g")])
def test_at_neutral_every_sensor_reads_what_it_read(kind, letter, name):
    y, values = swinging(), {f"{letter}{own}{k}": 0.0 for own in "egu" for k in (1, 2)}
    assert sensed(kind, name, y, **values) is y
    assert effect(kind).followed(y, DT, values) is y


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


@pytest.mark.parametrize("kind", ["sensor_delay", "sensor_gain"])
def test_where_one_channel_is_stated_the_others_are_right(kind):
    name = {"sensor_delay": "te2", "sensor_gain": "gg1"}[kind]
    model = looped(PAPER).with_effects([effect(kind)], {name: 0.003})
    assert {n: v for n, v in model.effect_values.items() if v} == {name: 0.003}


def test_the_gain_of_an_encoder_says_where_the_joints_are():
    model = looped(PAPER).with_effects([effect("sensor_gain")], {"ge2": 0.25})
    recording = simulate_recording(model, SimulateSpec(theta2=1.0, seconds=0.1), "r")
    tip = 0.5 + 0.5 * np.exp(0.8j)
    assert recording["theta2"][0] == pytest.approx(1.0, abs=ROUNDING)
    assert complex(recording["z1"][0], recording["z2"][0]) == pytest.approx(tip, abs=ROUNDING)


def rig(outputs=("z", "encoder"), servo=False, arm=PAPER, drive=None) -> Rig:
    return Rig(arm, drive or looped(arm).drive, "nonlinear", outputs, servo)


@pytest.mark.parametrize("kind", ["sensor_delay", "sensor_gain"])
@pytest.mark.parametrize(
    ("where", "letters"),
    [
        (rig(), "e"),
        (rig(outputs=("encoder", "deflection")), "eg"),
        (rig(outputs=("encoder", "torque")), "eu"),
        (rig(outputs=("torque",), servo=True), "e"),
        (rig(outputs=("torque", "deflection"), servo=True), "eg"),
        (rig(outputs=("torque", "link_encoder"), servo=True), "el"),
        (rig(outputs=("encoder", "torque"), drive=Torque()), "e"),
    ],
)
def test_only_what_the_rig_compares_can_be_late_or_scaled(kind, where, letters):
    one = effect(kind)
    assert not one.not_applicable(where)
    names = [k.parameter.name for k in one.parameters(PAPER, where.drive, typical(PAPER))]
    assert {name[1] for name in names if one.shown(name, where)} == set(letters)
    assert len(names) == 8  # two joints: encoders, gauges, torques, encoders on the links


@pytest.mark.parametrize("kind", ["sensor_delay", "sensor_gain"])
def test_a_rig_with_nothing_but_a_camera_is_told_so(kind):
    assert "camera has its own" in effect(kind).not_applicable(rig(outputs=("z",)))
    assert "camera has its own" in effect(kind).not_applicable(rig(outputs=("ydot",)))


def test_a_rigid_segment_has_no_gauge():
    names = [k.parameter.name for k in effect("sensor_gain").parameters(SLIDE, Torque(), None)]
    assert names == ["ge1", "gl1", "gu1"]


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
    place = simulate_within(model, model.numbers(), experiment_of(recording, model)).trajectory
    assert np.abs(at[1][10:-10, -2] - place.joint_positions[10:-10, 0]).max() < 1e-6
    assert np.array_equal(at[0][:, -2], recording["theta1"])


def experiment_of(recording, model):  # type: ignore[no-untyped-def]
    """The task that the recording came from."""
    task = experiment(model, None, seconds=0.2, amplitude=200.0)
    assert np.array_equal(task.references[:, 0], recording["u1"])
    return task
