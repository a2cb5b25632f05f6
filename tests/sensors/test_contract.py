"""What every sensor in the folder must keep; a new file inherits these tests."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from flexgui.core.errors import InputError
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.scenario.rig_spec import SensorsSpec
from flexgui.core.sensors import sensor, sensors
from flexgui.core.simulate.batch import run
from flexgui.core.simulate.experiment import make_task
from flexgui.core.simulate.linear import respond
from flexgui.core.trajectory import Trajectory
from tests.helpers import ARMS, looped

KINDS = sorted(sensors())
UNITS = {"rad", "rad/s", "m", "m/s", "m/s²", "N m", "N", ""}
AGREEMENT = 1e-12
"""Relative: the same linear output by two routes."""


@cache
def motions(name: str) -> tuple[Trajectory, Trajectory]:
    """A short non-linear and a linear motion."""
    model = looped(ARMS[name], gain=None if ARMS[name].joints == 2 else 20.0)
    numbers = model.numbers()
    task, _ = make_task(model, SimulateSpec(theta2=1.2, seconds=0.1), "r")
    return run(model, numbers, task, 2), respond(model, [numbers], [task])[0]


CASES = [
    (kind, name)
    for kind in KINDS
    for name in ("1-1", "slide", "0-2-1")
    if kind not in ("y", "ydot") or ARMS[name].two_revolute
]


@pytest.mark.parametrize(("kind", "name"), CASES)
def test_readings_have_one_finite_column_per_channel(kind: str, name: str) -> None:
    channels = sensor(kind).channels(ARMS[name])
    assert len({c.name for c in channels}) == len(channels)
    assert {c.unit for c in channels} <= UNITS
    for motion in motions(name):
        values = sensor(kind).measure(motion)
        assert values.shape == (len(motion.time), len(channels))
        assert np.all(np.isfinite(values))


@pytest.mark.parametrize(("kind", "name"), CASES)
def test_linear_rows_read_what_the_sensor_reads(kind: str, name: str) -> None:
    """Where a sensor has rows; camera and accelerometers are not linear in the state."""
    model = looped(ARMS[name], gain=None if ARMS[name].joints == 2 else 20.0)
    numbers = model.numbers()
    task, _ = make_task(model, SimulateSpec(theta2=1.2, seconds=0.1), "r")
    motion = respond(model, [numbers], [task])[0]
    rows = sensor(kind).rows(ARMS[name], numbers.p, numbers.law)
    if rows is None:
        assert kind in ("z", "acceleration")
        return
    values = sensor(kind).measure(motion)
    predicted = motion.q @ rows.Q.T + motion.v @ rows.V.T + task.references @ rows.R.T
    scale = max(np.abs(values).max(), 1.0)
    assert np.abs(values - predicted).max() < AGREEMENT * scale


@pytest.mark.parametrize("direct", [True, False])
@pytest.mark.parametrize(("kind", "name"), CASES)
def test_many_motions_are_read_as_each_alone(kind: str, name: str, direct: bool) -> None:
    """Whether the recording holds the channels or what they come from."""
    motion, found = motions(name)[1], sensor(kind)
    arm, model = motion.arm, looped(ARMS[name], gain=None if ARMS[name].joints == 2 else 20.0)
    law = model.numbers().law
    names = [c.name for c in found.channels(arm)] if direct else []
    recording = Recording("r", motion.time, {c: np.zeros(len(motion.time)) for c in names})
    rows = found.linear_rows(recording, arm, motion.p, law)
    assert rows is not None
    task, _ = make_task(model, SimulateSpec(theta2=1.2, seconds=0.1), "r")
    y = motion.q @ rows.Q.T + motion.v @ rows.V.T + task.references @ rows.R.T
    many = found.from_linear(
        np.stack([y, 2.0 * y, y], axis=2),
        recording,
        arm,
        motion.compiled,
        np.tile(motion.p, (3, 1)),
    )
    expected = found.measure_like(recording, motion)
    scale = max(np.abs(expected).max(), 1.0)
    for k in (0, 2):
        assert np.abs(many[:, :, k] - expected).max() < AGREEMENT * scale
    if found.is_linear(recording, arm):
        assert np.abs(many[:, :, 0] - y).max() == 0.0


@pytest.mark.parametrize("kind", KINDS)
def test_measured_reads_the_channels_of_a_recording(kind: str) -> None:
    found = sensor(kind)
    assert found.kind == kind and found.title
    assert found.noise in SensorsSpec.known_settings() or not (found.noise or found.primary)
    arm, motion = ARMS["1-1"], motions("1-1")[0]
    values = sensor(kind).measure(motion)
    names = [c.name for c in sensor(kind).channels(arm)]
    columns = dict(zip(names, values.T, strict=True))
    recording = Recording("r", motion.time, columns)
    assert sensor(kind).available(recording, arm)
    assert np.array_equal(sensor(kind).measured(recording, arm), values)
    assert not sensor(kind).available(Recording("r", motion.time, {}), arm)


def test_channels_carry_the_units_of_the_joints() -> None:
    slide = ARMS["slide"]
    assert [c.unit for c in sensor("encoder").channels(slide)] == ["m", "rad"]
    assert [c.unit for c in sensor("torque").channels(slide)] == ["N", "N m"]
    assert [c.name for c in sensor("deflection").channels(slide)] == ["deflection2"]


def test_an_unknown_output_is_named_with_the_nearest_known_one() -> None:
    with pytest.raises(InputError, match="did you mean 'encoder'"):
        sensor("encodr")
