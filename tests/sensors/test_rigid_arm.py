"""The fictitious rigid arm's angles and rates along motions."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.errors import InputError
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.recording.velocity import central_difference
from flexgui.core.sensors import sensor
from flexgui.core.simulate.experiment import make_task, simulate_recording
from flexgui.core.simulate.linear import respond
from flexgui.core.simulate.nonlinear import simulate_within
from tests.helpers import ARMS, PAPER, looped

ROUNDING = 1e-12
"""rad; the law of cosines at theta2 = 1.2 loses next to nothing."""

SLOPE = 2e-3
"""Relative: central differences over 0.1 ms of a vibration of some 500 rad/s."""

MULTISINE = {"excitation": "multisine", "options": {"highest_hz": 20.0, "periods": 1}}


def motion(arm, level: str = "nonlinear", dt: float = 1e-3):  # type: ignore[no-untyped-def]
    model = looped(arm)
    spec = SimulateSpec(theta2=1.2, seconds=0.3, sample_time=dt, **MULTISINE)
    task, _ = make_task(model, spec, "r")
    if level == "linear":
        return respond(model, [model.numbers()], [task])[0]
    return simulate_within(model, model.numbers(), task).trajectory


def test_rigid_angles_of_a_rigid_arm_are_its_encoders() -> None:
    path = motion(ARMS["rigid pair"])
    y, theta = sensor("y").measure(path), sensor("encoder").measure(path)
    assert np.abs(y - theta).max() < ROUNDING
    assert np.abs(sensor("ydot").measure(path) - path.v).max() < ROUNDING


@pytest.mark.parametrize("level", ["nonlinear", "linear"])
def test_ydot_is_the_derivative_of_y(level: str) -> None:
    path = motion(PAPER, level, dt=1e-4)
    y, ydot = sensor("y").measure(path), sensor("ydot").measure(path)
    slope = np.column_stack([central_difference(column, 1e-4) for column in y.T])
    inner = slice(20, -20)
    assert np.abs(slope - ydot)[inner].max() < SLOPE * np.abs(ydot).max()


def test_y_of_a_recording_comes_from_camera_and_encoders() -> None:
    recording = simulate_recording(looped(PAPER), SimulateSpec(theta2=1.2, seconds=0.2), "r")
    raw = {k: v for k, v in recording.channels.items() if not k.startswith("y")}
    bare = Recording("r", recording.time, raw)
    assert sensor("y").available(bare, PAPER)
    y = sensor("y").measured(bare, PAPER)
    assert np.abs(y[:, 0] - recording["y1"]).max() < ROUNDING
    assert np.abs(y[:, 1] - recording["y2"]).max() < ROUNDING


@pytest.mark.parametrize("level", ["nonlinear", "linear"])
def test_ydot_of_recording_and_model_take_the_same_route(level: str) -> None:
    """Without ydot columns both are differences of sampled angles, with the same error."""
    path = motion(PAPER, level)
    y = sensor("y").measure(path)
    z = sensor("z").measure(path)
    columns = dict(zip(("z1", "z2"), z.T, strict=True))
    columns |= dict(zip(("theta1", "theta2"), path.joint_positions.T, strict=True))
    bare = Recording("r", path.time, columns)
    modelled = sensor("ydot").measure_like(bare, path)
    slope = np.column_stack([central_difference(column, 1e-3) for column in y.T])
    assert np.abs(modelled - slope).max() < 1e-9  # rounding of angles over 2 ms
    if level == "nonlinear":
        assert np.abs(sensor("ydot").measured(bare, PAPER) - modelled).max() < 1e-9


@pytest.mark.parametrize("kind", ["y", "ydot"])
@pytest.mark.parametrize("theta2", [0.0, 0.04, np.pi - 0.04, -np.pi])
def test_a_stretched_or_folded_arm_is_refused_and_z_offered(kind: str, theta2: float) -> None:
    columns = {"theta1": np.zeros(5), "theta2": np.full(5, theta2)}
    recording = Recording("stretched", np.arange(5) * 1e-3, columns)
    with pytest.raises(InputError) as caught:
        sensor(kind).check(PAPER, recording)
    assert "stretched" in str(caught.value)
    assert 'output = "z"' in str(caught.value)
    assert "\n" not in str(caught.value)
    regular = Recording("r", recording.time, {**columns, "theta2": np.full(5, 1.0)})
    sensor(kind).check(PAPER, regular)
    with pytest.raises(InputError, match='output = "z"'):
        sensor(kind).check(ARMS["0-2-1"], regular)
