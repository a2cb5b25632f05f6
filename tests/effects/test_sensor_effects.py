"""What delays, lags, turned cameras and shifted encoders make of a motion."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lsim

from flexgui.core.effects import effect
from flexgui.core.effects.effect import Rig
from flexgui.core.effects.sizes import typical
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.sensors import sensor
from flexgui.core.simulate.experiment import simulate_recording
from flexgui.core.simulate.nonlinear import simulate_within
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


@pytest.mark.parametrize(
    ("kind", "neutral"),
    [
        ("camera_delay", {"td": 0.0}),
        ("sensor_lag", {"ts": 0.0}),
        ("camera_misalignment", {"ca": 0.0, "cs": 0.0}),
        ("encoder_offset", {"eo2": 0.0}),
    ],
)
@pytest.mark.parametrize("name", ["z", "y", "ydot", "encoder", "deflection", "torque"])
def test_at_neutral_every_sensor_reads_what_it_read(kind, neutral, name):
    y = swinging()
    assert np.array_equal(sensed(kind, name, y, **neutral), y)


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
    ],
)
def test_what_a_rig_cannot_show_is_said(kind, rigs, words):
    assert words in effect(kind).not_applicable(rigs)


@pytest.mark.parametrize(
    "kind", ["camera_delay", "sensor_lag", "camera_misalignment", "encoder_offset"]
)
def test_the_papers_rig_shows_every_sensor_effect(kind):
    assert not effect(kind).not_applicable(rig())
    assert effect(kind).parameters(PAPER, looped(PAPER).drive, typical(PAPER))
