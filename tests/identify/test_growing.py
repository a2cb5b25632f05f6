"""A descent that begins with the first swings finds a stiffness that whole recordings hide."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.segment import Segment
from flexgui.core.drives.servo import FollowingServo
from flexgui.core.drives.torque import Torque
from flexgui.core.identify.predictor import Predictor
from flexgui.core.identify.prepared_recording import Prepared, prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.identify.refinement import first_parts, refine, starts_over_horizon
from flexgui.core.identify.residuals import Residuals
from flexgui.core.identify.unknowns import Unknown, Unknowns
from flexgui.core.model import Model
from flexgui.core.parameters import Parameter
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.velocity import ZeroPhaseLowPass
from flexgui.core.sensors import sensor
from flexgui.core.simulate.nonlinear import simulate_within
from tests.helpers import from_rest, read

SEGMENTS = (
    Segment(length=0.6, mass=4.0, EI=300.0, hub_inertia=0.15, modes=1),
    Segment(length=0.5, mass=2.5, EI=60.0, hub_inertia=0.08, modes=1),
)
ARM = Arm(segments=SEGMENTS)
TRUE = np.array([300.0, 60.0])
STEP, SAMPLES, HOLD = 4e-3, 750, 15
"""s; the second link, held at its joint, swings some dozen times."""

OFF = (0.7, 1.43)
"""Factors of the stiffness: what is stated of a beam may be a third off."""

FOUND = 0.01
"""Relative: the recordings have no noise, but a spline between their samples."""


def recording() -> Recording:
    rng = np.random.default_rng(3)
    torque = np.array([6.0, 2.0]) * np.repeat(
        rng.choice([-1.0, 1.0], (SAMPLES // HOLD, 2)), HOLD, axis=0
    )
    model = Model(ARM, Torque(), "nonlinear")
    task = from_rest(model, [0.0, 0.8], torque, STEP)
    motion = simulate_within(model, model.numbers(), task, 1e-8).trajectory
    return read(model, task, motion, "encoder")


@pytest.fixture(scope="module")
def experiment() -> Prepared:
    model = Model(ARM, Torque(), "nonlinear").steered_by(
        FollowingServo(Torque(), 60.0, (1.5, 0.25))
    )
    return prepare(
        model, recording(), [sensor("torque")], Processing(ZeroPhaseLowPass(cutoff_hz=30.0))
    )


def residuals(e: Prepared, factors: tuple[float, float]) -> Residuals:
    starts = zip(TRUE, factors, strict=True)
    items = tuple(
        Unknown(Parameter(f"EI{k + 1}", x * f, "N m²", 0.1 * x, 10.0 * x))
        for k, (x, f) in enumerate(starts)
    )
    predictor = Predictor([e], Unknowns(items), steps=4)
    return Residuals(predictor, [np.ones(2)])


def apart(vector: np.ndarray) -> float:
    return float(np.abs(vector / TRUE - 1.0).max())


def test_the_first_swings_lead_to_the_true_stiffness(experiment: Prepared) -> None:
    r = residuals(experiment, OFF)
    start = r.unknowns.parameters.vector()
    (led,) = starts_over_horizon(r, [start], lambda _: False)
    assert apart(led) < FOUND
    at_once = refine(r, start, lambda _: False, 1e-6)
    assert apart(at_once.vector) > 10.0 * FOUND  # or the way by the first swings shows nothing


def test_no_start_ends_where_the_whole_recordings_fit_worse(experiment: Prepared) -> None:
    e, first = experiment, SAMPLES // 8
    shaken = 20.0 * np.random.default_rng(1).standard_normal((2, SAMPLES))
    shaken[:, first:] = 0.0
    channels = {**e.recording.channels}
    for name, x in zip(("u1", "u2"), shaken, strict=True):
        channels[name] = channels[name] + x
    wrong = replace(e.recording, channels=channels)
    r = residuals(prepare(e.model, wrong, e.outputs, e.processing), OFF)
    starts = [TRUE * factors for factors in (OFF, (1.0, 1.0), (1.1, 0.95), (0.5, 2.0))]
    before, after = (r.costs(np.array(x)) for x in (starts, grown_from(r, starts)))
    assert np.all(after <= before)


def grown_from(r: Residuals, starts: list[np.ndarray]) -> list[np.ndarray]:
    return starts_over_horizon(r, starts, lambda _: False)


def test_a_beginning_is_what_was_recorded_first(experiment: Prepared) -> None:
    (part,) = first_parts([experiment], 0.25)
    count = len(part.recording.time)
    assert count == int(np.ceil(0.25 * SAMPLES))
    inner = slice(0, count - 1)  # at its end the speed is a one-sided difference
    assert np.array_equal(part.task.references[inner], experiment.task.references[inner])
