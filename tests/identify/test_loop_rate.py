"""Torques are held from sample to sample, or are those of their instants in a faster loop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import flexgui as fg
from flexgui.core.arm.arm import Arm
from flexgui.core.arm.segment import Segment
from flexgui.core.drives.servo import FollowingServo
from flexgui.core.drives.torque import Torque
from flexgui.core.identify.loop_rate import better_loop, with_servo
from flexgui.core.identify.predictor import Predictor
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.identify.residuals import Residuals
from flexgui.core.identify.unknowns import Unknowns
from flexgui.core.model import Model
from flexgui.core.recording.recording import Recording
from flexgui.core.sensors import sensor
from flexgui.core.simulate.nonlinear import simulate_within
from tests.helpers import from_rest, rms

LINK = Arm(segments=(Segment(length=0.46, mass=1.2, EI=20.0, hub_inertia=0.04, modes=1),))
LOOP, SECONDS = 1e-3, 4.0
RATIO = 10
"""Samples of the loop per sample of its recording."""
LEFT = 0.03
"""Of the torque's rms, by the right rate: the straight lines between samples at 100 Hz."""
HALF_SAMPLE_LATE = 0.06
"""The same, at least, by the wrong rate: half a sample of sines of 1.1 and 3.3 Hz is 0.035 and
0.104 of their sizes, less where the motion begins softly."""

NOISE, FINE = 0.01, 1e-6
"""N m and rad, of the sensors of what is diagnosed."""


def residuals(ratio: int, faster_loop: bool) -> Residuals:
    """Of a rig whose loop takes `ratio` samples for each recorded one."""
    model, step = Model(LINK, Torque(), "nonlinear"), RATIO * LOOP / ratio
    t = np.arange(round(SECONDS / step)) * step
    soft = np.clip(t / 0.5, 0.0, 1.0) ** 3
    torque = (soft * (np.sin(2 * np.pi * 1.1 * t) + np.sin(2 * np.pi * 3.3 * t)))[:, None]
    task = from_rest(model, [0.0], torque, step)
    place = simulate_within(model, model.numbers(), task, 1e-9).trajectory.joint_positions[:, 0]
    kept = {"u1": torque[::ratio, 0], "theta1": place[::ratio]}
    servo = FollowingServo(Torque(), 60.0, (0.12,), faster_loop=faster_loop)
    e = prepare(
        model.steered_by(servo), Recording("r", t[::ratio], kept), [sensor("torque")], Processing()
    )
    return Residuals(Predictor([e], Unknowns(()), steps=4), [np.ones(1)])


@pytest.mark.parametrize(("ratio", "faster"), [(1, False), (RATIO, True)])
def test_the_rate_of_the_loop_is_seen_in_the_torque(ratio: int, faster: bool) -> None:
    right, wrong, nothing = residuals(ratio, faster), residuals(ratio, not faster), np.zeros(0)
    size = rms(right.experiments[0].measured)
    assert rms(right(nothing)) < LEFT * size
    assert rms(wrong(nothing)) > HALF_SAMPLE_LATE * size
    assert better_loop(right, nothing) is None
    stated = with_servo(wrong, replace(wrong.experiments[0].model.servo, loop_stated=True))
    assert better_loop(stated, nothing) is None
    servo = better_loop(wrong, nothing)
    assert servo is not None and servo.faster_loop == faster
    assert with_servo(wrong, servo)(nothing) == pytest.approx(right(nothing))


def test_what_no_torque_is_compared_with_shows_no_rate() -> None:
    without = replace(residuals(1, True).experiments[0], outputs=(), measured=np.zeros((0, 0)))
    assert better_loop(Residuals(Predictor([without], Unknowns(())), []), np.zeros(0)) is None


@pytest.mark.long
@pytest.mark.parametrize("ratio", [1, 10 * RATIO])
def test_half_a_sample_is_never_named_as_a_delay(ratio: int) -> None:
    recordings = [
        {"table": table(ratio, seed), "name": f"r{seed}", "role": role}
        for seed, role in enumerate(("estimate", "estimate", "validate"))
    ]
    link = {"length": 0.46, "mass": 1.2, "EI": 20.0, "hub_inertia": 0.04, "modes": 1}
    rig = fg.project(
        {"segments": [link]},
        fg.drives.Torque(), recordings, sensors={"torque_noise": NOISE, "encoder_noise": FINE},
        identify={"parameters": ["EI1", "Jh1"]},
    )  # fmt: skip
    assert rig.diagnose().added == ()


def table(ratio: int, seed: int) -> pd.DataFrame:
    """Torques of sines with random phases, and the places of the joint."""
    model, step = Model(LINK, Torque(), "nonlinear"), RATIO * LOOP / ratio
    rng = np.random.default_rng(seed)
    t = np.arange(round(SECONDS / step)) * step
    soft = np.clip(t / 0.5, 0.0, 1.0) ** 3
    phases = rng.uniform(0.0, 2.0 * np.pi, 2)
    waves = (np.sin(2 * np.pi * f * t + p) for f, p in zip((1.1, 3.3), phases, strict=True))
    torque = (soft * sum(waves))[:, None]
    task = from_rest(model, [0.0], torque, step)
    motion = simulate_within(model, model.numbers(), task, 1e-9).trajectory
    place = motion.joint_positions[:, 0]
    u = torque[::ratio, 0] + NOISE * rng.standard_normal(len(t[::ratio]))
    seen = place[::ratio] + FINE * rng.standard_normal(len(u))
    return pd.DataFrame({"t": t[::ratio], "u1": u, "theta1": seen})
