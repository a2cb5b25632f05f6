"""Joints led between samples that do not show how the arm vibrates."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from core.arm.arm import Arm
from core.arm.segment import Segment
from core.drives.servo import FollowingServo
from core.drives.torque import Torque
from core.drives.velocity_loop import VelocityLoop
from core.effects import effect
from core.identify.growing import grown
from core.identify.guide import guide, guide_all, is_guided
from core.identify.led_motion import joint_motion
from core.identify.led_points import SELDOM, fastest_swing, finer_by, hidden_between
from core.identify.predictor import Predictor, motion_of
from core.identify.prepared import Prepared, prepare
from core.identify.refinement import refine
from core.identify.residuals import Residuals
from core.identify.unknowns import Unknown, Unknowns
from core.model import Model
from core.parameters import Parameter
from core.recording.recording import Recording
from core.sensors import sensor
from core.simulate.motion import Task, at_rest
from core.simulate.nonlinear import simulate_within
from tests.identify.test_switching_torque import LINK, PROCESSING, rms

STEP, SAMPLES, HOLD = 12e-3, 160, 2
"""s; the link vibrates at 50 Hz, 3.8 rad from one sample to the next: samples show it at 33 Hz."""

FINE = 8
"""Points per sample at which the true motion is known."""

FOLLOWS = 0.02
"""Of the vibration: what a guide of the true arm may miss of it."""

BETTER = 1e-3
"""Of what splines leave at the true stiffness, which is what a guide may leave."""

ROUGH = 0.05
"""The same with friction, whose sign turns within a sample."""

FOUND = 2e-3
"""Relative; splines alone end a third off."""

OFF = (0.7, 1.43)
"""Factors of the stiffness: what is stated of a beam may be a third off."""


FRICTION = {"fc1": 1.0}
"""N m, an eighth of the torque."""


def arm(friction: bool) -> Model:
    bare = Model(LINK, Torque(), "nonlinear")
    return bare.with_effects([effect("coulomb_friction")], FRICTION) if friction else bare


@cache
def true_motion(friction: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Held torque (SAMPLES, 1), and the joint's positions at FINE points per sample."""
    rng = np.random.default_rng(8)
    torque = 8.6 * np.repeat(rng.choice([-1.0, 1.0], SAMPLES // HOLD), HOLD)[:, None]
    model = arm(friction)
    start = at_rest(np.array([-0.2]), LINK.coordinates)
    time = np.arange(SAMPLES * FINE) * (STEP / FINE)
    task = Task(time, np.repeat(torque, FINE, axis=0), start, np.zeros((1, LINK.coordinates)))
    found = simulate_within(model, model.numbers(), task, 1e-9).trajectory
    return torque, found.joint_positions[:, 0]


@cache
def prepared(guided: bool, friction: bool = False) -> Prepared:
    torque, place = true_motion(friction)
    channels = {"u1": torque[:, 0], "theta1": place[::FINE]}
    recording = Recording("r", np.arange(SAMPLES) * STEP, channels)
    servo = FollowingServo(Torque(), 60.0, (0.29,), PROCESSING.band_hz(["torque"]), guided)
    model = arm(friction).steered_by(servo)
    return prepare(model, recording, [sensor("torque")], PROCESSING)


def left(e: Prepared) -> float:
    numbers = e.model.numbers()
    apart = e.predicted(motion_of(e, numbers, {}, 4), numbers, {}) - e.measured
    return rms(apart[e.counted])


def residuals(factor: float) -> Residuals:
    EI = LINK.segments[0].EI
    stiffness = Unknown(Parameter("EI1", factor * EI, "N m²", 0.1 * EI, 10.0 * EI))
    return Residuals(Predictor([prepared(True)], Unknowns((stiffness,)), steps=2), [np.ones(1)])


def test_samples_hide_this_vibration_and_show_a_slower_one() -> None:
    servo = prepared(True).model.steering
    assert isinstance(servo, FollowingServo)
    assert hidden_between(prepared(True).model, servo, STEP)
    assert not hidden_between(prepared(True).model, servo, STEP / 10)


def test_further_bending_shapes_are_no_reason_for_a_guide() -> None:
    shapes = Arm(segments=(Segment(length=0.46, mass=3.5, EI=545.0, hub_inertia=0.04, modes=3),))
    servo = FollowingServo(Torque(), 60.0, (0.29,))
    model = Model(shapes, Torque(), "nonlinear").steered_by(servo)
    assert fastest_swing(model, model.numbers(), STEP / 10) > SELDOM
    assert not hidden_between(model, servo, STEP / 10)
    assert hidden_between(model, servo, STEP)


def test_a_guide_of_the_true_arm_goes_between_samples_as_the_arm_went() -> None:
    e = prepared(True)
    finer = finer_by(e.model, STEP)
    place = true_motion()[1][:: FINE // finer] if finer <= FINE else None
    assert place is not None
    apart = guide(e.model, e.model.numbers(), e.task)[:, 0] - place[: finer * (SAMPLES - 1) + 1]
    vibration = np.diff(place[::finer], 2)
    assert rms(np.diff(apart[::finer], 2)) < FOLLOWS * rms(vibration)


def test_joints_are_led_through_every_sample() -> None:
    e = prepared(True)
    led = joint_motion(e.model, e.model.numbers(), e.task)
    at_samples = led.place[led.lead * led.finer :: led.finer, 0]
    np.testing.assert_array_equal(at_samples, e.recording["theta1"])


def test_at_the_true_stiffness_nothing_is_left_that_splines_left() -> None:
    assert left(prepared(True)) < BETTER * left(prepared(False))


def test_friction_brakes_and_shakes_a_guide_as_it_does_the_arm() -> None:
    assert left(prepared(True, True)) < ROUGH * left(prepared(False, True))


@pytest.mark.parametrize("factor", OFF)
def test_the_stiffness_is_found_from_a_third_off(factor: float) -> None:
    found = residuals(factor)
    start = found.unknowns.parameters.vector()
    vector = refine(found, grown(found, start, lambda _: False), lambda _: False).vector
    assert vector[0] == pytest.approx(LINK.segments[0].EI, rel=FOUND)


def test_guides_that_are_made_together_are_those_made_alone() -> None:
    e = prepared(True)
    stiff = [e.model.numbers({"EI1": EI}) for EI in (400.0, 700.0)]
    alone = [guide(e.model, n, e.task).copy() for n in stiff]
    other = replace(e.task, references=e.task.references.copy())
    guide_all([(e.model, n, other) for n in stiff], 2)
    for n, known in zip(stiff, alone, strict=True):
        np.testing.assert_allclose(guide(e.model, n, other), known, atol=1e-9)


def test_a_linear_model_and_one_that_nothing_leads_have_no_guide() -> None:
    guided = prepared(True).model
    assert is_guided(guided)
    assert not is_guided(guided.at_level("lpv")) and not is_guided(guided.steered_by(None))


def test_a_drives_own_feedback_is_told_from_the_servos() -> None:
    drive = VelocityLoop(gains=(60.0,))
    servo = FollowingServo(drive, 60.0, (0.29,))
    p = Model(LINK, drive, "nonlinear").numbers().p
    own = drive.law(LINK, p, {})
    by_place, by_speed = servo.own_feedback(servo.law(LINK, p, {}))
    np.testing.assert_allclose(by_place, own.P[:, :1], atol=1e-9)
    np.testing.assert_allclose(by_speed, own.V[:, :1], atol=1e-9)
