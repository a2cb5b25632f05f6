"""What brakes a joint counts as long as the torque that it is compared with: two samples."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from flexgui.core.drives.drive import Drive
from flexgui.core.drives.servo import FollowingServo, averaged, rates, slopes
from flexgui.core.drives.torque import Torque
from flexgui.core.drives.voltage import Voltage
from flexgui.core.effects import effect
from flexgui.core.identify.predictor import motion_of
from flexgui.core.identify.prepared_recording import Prepared, prepare
from flexgui.core.identify.prescribed_joint_motion import UNKNOWN_END, unknown_ends
from flexgui.core.identify.processing import Processing
from flexgui.core.model import Model
from flexgui.core.recording.velocity import ZeroPhaseLowPass
from flexgui.core.sensors import sensor
from flexgui.core.simulate.nonlinear import simulate_within
from tests.helpers import from_rest, read, rms
from tests.identify.test_switching_torque import LINK

STEP, SAMPLES, HOLD = 4e-3, 500, 2
"""s; the link vibrates at 50 Hz, 1.3 rad from one sample to the next."""

PROCESSING = Processing(ZeroPhaseLowPass(cutoff_hz=80.0))
"""Lets the vibration through."""

FRICTION = 1.0
"""N m s/rad"""

BRAKES = Voltage(torque_constants=(0.5,), resistances=(0.25,))
"""Its back-EMF brakes with the same, kt^2 / Ra."""

RIGHT = 0.02
"""Relative. With central differences, and friction as it is at a sample, 1.15 was found, and 0.15
where the motor alone brakes."""

EXACT = 0.02
"""Of a curve's rms: what a cubic spline misses at 1.3 rad per sample; central differences 25 %."""

QUIET = 0.05
"""Of the torque's rms: what a true model may leave of it at the ends of a recording; as the spline
says it there, a fifth was left."""


@cache
def prepared(drive: Drive, friction: float) -> Prepared:
    """A link that was moved with friction, as a model without it sees it."""
    rng = np.random.default_rng(5)
    signal = np.repeat(rng.choice([-1.0, 1.0], SAMPLES // HOLD), HOLD)[:, None]
    signal *= 3.0 if isinstance(drive, Torque) else 1.5
    bare = Model(LINK, drive, "nonlinear")
    moved = bare.with_effects([effect("viscous_friction")], {"fv1": friction}) if friction else bare
    task = from_rest(moved, [0.1], signal, STEP)
    motion = simulate_within(moved, moved.numbers(), task, 1e-9).trajectory
    recording = read(moved, task, motion, "encoder")
    servo = FollowingServo(drive, 60.0, (0.29,), PROCESSING.band_hz(["torque"]))
    return prepare(bare.steered_by(servo), recording, [sensor("torque")], PROCESSING)


def missed(e: Prepared, model: Model) -> np.ndarray:
    """(M,) of the torque, by a model with the servo of a recording."""
    numbers = model.numbers()
    seen = prepare(model, e.recording, [sensor("torque")], PROCESSING)
    return (seen.measured - seen.predicted(motion_of(seen, numbers, {}, 4), numbers, {}))[:, 0]


def found(e: Prepared) -> float:
    """N m s/rad of viscous friction that explains most of what the model misses."""
    braked = e.model.with_effects([effect("viscous_friction")], {"fv1": 1.0})
    plain = missed(e, e.model)
    slope = plain - missed(e, braked)
    return float(slope @ plain / (slope @ slope))


def test_friction_at_a_vibrating_joint_has_its_size() -> None:
    assert found(prepared(Torque(), FRICTION)) == pytest.approx(FRICTION, rel=RIGHT)


def test_what_a_motor_brakes_by_itself_is_no_friction() -> None:
    assert abs(found(prepared(BRAKES, 0.0))) < RIGHT * FRICTION
    assert found(prepared(BRAKES, FRICTION)) == pytest.approx(FRICTION, rel=RIGHT)


def test_the_ends_of_a_recording_are_no_error_of_the_model() -> None:
    e = prepared(Torque(), 0.0)
    left, torque = missed(e, e.model), rms(e.measured)
    assert rms(left[:UNKNOWN_END]) < QUIET * torque
    assert rms(left[-UNKNOWN_END:]) < QUIET * torque


def test_a_beginning_at_rest_is_known() -> None:
    e = prepared(Torque(), 0.0)
    assert unknown_ends(e.model, e.task) == (1, UNKNOWN_END)
    assert unknown_ends(e.model, replace(e.task, before=None)) == (UNKNOWN_END, UNKNOWN_END)


def test_a_speed_between_few_samples_is_that_of_a_spline() -> None:
    t = np.arange(60) * STEP
    w = 1.3 / STEP
    wave, speed = np.sin(w * t)[:, None], w * np.cos(w * t)[:, None]
    inner = slice(8, -8)
    assert rms((slopes(wave, STEP) - speed)[inner]) < EXACT * rms(speed)
    assert rms((rates(wave, STEP) - speed)[inner]) > 10.0 * EXACT * rms(speed)
    assert np.isnan(slopes(np.where(t[:, None] < 0.1, wave, np.nan), STEP)).all()


def test_an_average_is_that_of_a_triangle() -> None:
    fine, w = 64, 0.9
    at = np.arange(-40 * fine, 40 * fine + 1) / fine
    triangle = np.maximum(1.0 - np.abs(np.arange(-fine, fine + 1)) / fine, 0.0) / fine
    mean = np.convolve(np.sin(w * at), triangle, mode="same")[::fine][5:-5]
    assert averaged(np.sin(w * at[::fine])[:, None])[5:-5, 0] == pytest.approx(mean, abs=EXACT)
