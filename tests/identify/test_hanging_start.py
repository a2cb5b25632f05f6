"""A resting arm hangs as its weight bends it; where nothing shows that it rests, it may."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.segment import Segment
from flexgui.core.drives.servo import FollowingServo
from flexgui.core.drives.torque import Torque
from flexgui.core.identify.first_states import bent_by_weight
from flexgui.core.identify.predictor import motion_of
from flexgui.core.identify.prepared_recording import Prepared, prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.identify.unknowns import starts_unknown
from flexgui.core.model import Model
from flexgui.core.recording.initial_motion import with_beginnings
from flexgui.core.recording.recording import Beginning, Recording
from flexgui.core.scenario.schema import IdentifySpec
from flexgui.core.sensors import sensor
from tests.helpers import rms

LENGTH, MASS, EI, G = 0.5, 1.0, 300.0, 9.81
BEAM = Arm(segments=(Segment(length=LENGTH, mass=MASS, EI=EI, modes=2),), gravity=(0.0, -G))
STEP, SAMPLES, MOVES = 1e-2, 400, 100

EULER = 1e-3
"""Of the sag: the beam's slope shortens its lever, which Euler and Bernoulli neglect."""

HEAVY = 1e-6
"""m/s; held joints weigh a million times what turns about them."""


def recording(noise: float = 0.0, first: int = 0) -> Recording:
    """A beam that lies, then is raised; from its sample `first` on."""
    rng = np.random.default_rng(4)
    t = np.arange(SAMPLES) * STEP
    moved = np.clip((np.arange(SAMPLES) - MOVES) / (SAMPLES - MOVES), 0.0, 1.0)
    place = 0.5 * (1.0 - np.cos(2.0 * np.pi * moved)) + noise * rng.standard_normal(SAMPLES)
    gauge = 1e-3 * np.cos(place) + noise * rng.standard_normal(SAMPLES)
    channels = {"theta1": place, "u1": np.zeros(SAMPLES), "deflection1": gauge}
    return Recording("r", t[: SAMPLES - first], {n: x[first:] for n, x in channels.items()})


def begun(r: Recording, weighs: bool = True) -> Beginning:
    (known,) = with_beginnings([r], 1, ("u1",), held=False, weighs=weighs)
    return known.beginning


def prepared(beginning: Beginning, arm: Arm = BEAM) -> Prepared:
    model = Model(arm, Torque(), "nonlinear").steered_by(FollowingServo(Torque(), 60.0, (0.1,)))
    held = {"theta1": np.zeros(SAMPLES), "u1": np.zeros(SAMPLES)}
    r = Recording("r", np.arange(SAMPLES) * STEP, held, beginning=beginning)
    return prepare(model, r, [sensor("torque")], Processing())


def test_a_beam_sags_as_euler_and_bernoulli_say() -> None:
    model = Model(BEAM, Torque(), "nonlinear")
    bent = bent_by_weight(model, np.zeros(1), {})
    tip, _ = model.compiled.tip_place(np.array([0.0, *bent]), model.numbers().p)
    sag = MASS * G * LENGTH**3 / (8.0 * EI)
    assert tip[1] == pytest.approx(-sag, rel=EULER)


@pytest.mark.parametrize("place", [0.0, 1.0, -2.5])
def test_nothing_pushes_a_bent_arm_back(place: float) -> None:
    model = Model(BEAM, Torque(), "nonlinear")
    p = model.numbers().p
    q = np.array([place, *bent_by_weight(model, np.array([place]), {})])
    straight, bent = (
        np.abs(model.compiled.mass_and_force(x, np.zeros_like(q), p)[1][1:]).max()
        for x in (np.array([place, 0.0, 0.0]), q)
    )
    assert bent < 1e-9 * straight


@pytest.mark.parametrize("beginning", Beginning)
def test_a_held_beam_swings_only_where_it_is_let_go(beginning: Beginning) -> None:
    e = prepared(beginning)
    motion = motion_of(e, e.model.numbers(), {}, 1)
    speed = rms(motion.v[:, 1:])
    if beginning is Beginning.REST:
        assert speed > 0.01
    else:
        assert speed < HEAVY


def test_an_arm_without_weight_begins_straight() -> None:
    light = prepared(Beginning.EQUILIBRIUM, Arm(segments=BEAM.segments))
    assert light.task_at({}) is light.task


@pytest.mark.parametrize("noise", [0.0, 1e-5])
def test_a_log_that_begins_before_its_motion_hangs(noise: float) -> None:
    r = recording(noise)
    assert begun(r) is Beginning.EQUILIBRIUM
    assert begun(r, weighs=False) is Beginning.REST
    known = replace(r, beginning=begun(r))
    assert not starts_unknown(IdentifySpec(), known)


def test_where_it_moves_at_once_nothing_shows_whether_it_hangs() -> None:
    assert begun(recording(first=MOVES)) is not Beginning.EQUILIBRIUM
    assert begun(recording(first=MOVES)) is not Beginning.REST
