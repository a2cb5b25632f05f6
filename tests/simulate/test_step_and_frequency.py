"""Step and frequency response against python-control, and their final values."""

from __future__ import annotations

import control
import numpy as np
import pytest
import scipy.linalg

from flexgui.core.drives.torque import Torque
from flexgui.core.model import Model
from flexgui.core.simulate.linear import respond
from flexgui.core.simulate.motion import Task
from flexgui.core.simulate.posture import Posture, posture
from flexgui.core.simulate.response import (
    default_output,
    exponential,
    frequency_grid,
    frequency_response,
    horizon,
    linear_output,
    step_response,
)
from tests.helpers import ARMS, loaded, looped
from tests.simulate.test_linear_model import CASCADE, FILTERED

SAME_GAIN = 1e-7
"""Relative to the largest gain of the grid: stiff matrices, two ways of solving."""

SAME_STEP = 1e-7
"""Relative: exact discretisations, so only roundings."""

SETTLED = 5e-3
"""What exp(-6) leaves after the shown time, and a little for several poles at once."""

SAME_EXPONENTIAL = 1e-10

JOINTS = np.array([0.3, 1.2])


def at(name: str = "1-1") -> Posture:
    arm = ARMS[name]
    return posture(looped(arm, None if arm.joints == 2 else 20.0), np.resize(JOINTS, arm.joints))


def system(here: Posture, kind: str) -> control.StateSpace:
    out = linear_output(here, kind)
    A, B = (np.linalg.solve(here.E, X) for X in (here.A, here.B))
    return control.ss(A, B, out.C, out.D)


@pytest.mark.parametrize("kind", ["ydot", "deflection", "encoder", "torque", "z"])
def test_frequency_response_agrees_with_control(kind: str) -> None:
    here = at()
    found = frequency_response(here, kind)
    expected = system(here, kind)(2j * np.pi * found.frequency)
    assert found.gain.shape == (len(found.frequency), len(found.outputs), 2)
    miss = np.abs(np.moveaxis(expected, -1, 0) - found.gain).max()
    assert miss < SAME_GAIN * np.abs(expected).max()


@pytest.mark.parametrize("kind", ["ydot", "deflection"])
def test_step_response_agrees_with_control(kind: str) -> None:
    here = at("2-2")
    found = step_response(here, kind)
    expected = control.step_response(system(here, kind), found.time).outputs
    miss = np.abs(np.moveaxis(expected, -1, 0) - found.values).max()
    assert miss < SAME_STEP * np.abs(found.values).max()


def test_step_response_is_the_simulators() -> None:
    here = at()
    found = step_response(here, "encoder", seconds=0.256)
    n = here.model.arm.coordinates
    start = np.concatenate([here.q, np.zeros(n)])
    refs = np.zeros((len(found.time), 2))
    refs[:, 1] = 1.0
    motion = respond(here.model, [here.numbers], [Task(found.time, refs, start, here.q[None])])[0]
    moved = motion.q[:, :2] - JOINTS
    assert np.allclose(found.values[:, :, 1], moved, atol=SAME_STEP)


def test_a_velocity_loop_reaches_its_reference() -> None:
    """Without friction the joints, and with them the rigid arm's, end at the asked velocity."""
    values = step_response(at(), "ydot").values
    assert np.abs(values[-1] - np.eye(2)).max() < SETTLED


def test_a_position_loop_reaches_its_reference() -> None:
    here = posture(Model(ARMS["1-1"], CASCADE), JOINTS)
    assert np.abs(step_response(here, "encoder").values[-1] - np.eye(2)).max() < SETTLED


def test_gain_at_low_frequency_is_the_final_value_of_the_step() -> None:
    here = at()
    gain = frequency_response(here, "ydot", np.array([1e-3])).gain[0]
    assert np.allclose(gain, np.eye(2), atol=SETTLED)


def test_a_resonance_is_hit_at_its_peak() -> None:
    """A peak narrower than the even grid's spacing is not lost."""
    here = posture(Model(ARMS["one mode"], Torque()), np.array([0.0]))
    grid = frequency_grid(here.poles)
    resonance = np.abs(here.poles.imag).max() / (2.0 * np.pi)
    assert np.abs(grid / resonance - 1.0).min() < SAME_GAIN
    assert np.all(np.diff(grid) > 0.0)


def test_an_undamped_arm_still_has_a_length_of_time_to_show() -> None:
    here = posture(Model(ARMS["one mode"], Torque()), np.array([0.0]))
    found = step_response(here)
    slowest = np.abs(here.poles.imag).max() / (2.0 * np.pi)
    assert 1.0 / slowest < found.time[-1] < 100.0 / slowest
    assert np.all(np.isfinite(found.values))


def test_the_shown_time_is_round() -> None:
    lengths = [horizon(np.array([complex(-a, 0.0), complex(-1e4, 0.0)])) for a in (3.0, 20.0, 21.0)]
    assert lengths == [2.0, 0.5, 0.5]
    assert horizon(np.zeros(2, complex)) == 1.0


@pytest.mark.parametrize(
    ("name", "kind"),
    [("1-1", "ydot"), ("slide", "deflection"), ("rigid pair", "ydot"), ("one mode", "deflection")],
)
def test_the_output_suits_the_arm(name: str, kind: str) -> None:
    here = at(name)
    assert default_output(here.model) == kind
    found = step_response(here)
    assert found.values.shape[1:] == (len(found.outputs), len(found.references))


def test_ports_carry_their_units() -> None:
    found = step_response(at("slide"))
    assert [(p.name, p.unit) for p in found.references] == [
        ("dtheta1_ref", "m/s"),
        ("dtheta2_ref", "rad/s"),
    ]
    assert [(p.name, p.unit) for p in found.outputs] == [("deflection2", "rad")]


def test_a_drive_with_states_is_part_of_the_response() -> None:
    here = posture(Model(loaded(ARMS["1-1"]), FILTERED), JOINTS)
    found = frequency_response(here, "encoder")
    expected = system(here, "encoder")(2j * np.pi * found.frequency)
    miss = np.abs(np.moveaxis(expected, -1, 0)[:, :, :2] - found.gain).max()
    assert miss < SAME_GAIN * np.abs(found.gain).max()


@pytest.mark.parametrize("size", [0.0, 1e-3, 1.0, 300.0])
def test_exponential_agrees_with_scipy(size: float) -> None:
    draw = np.random.default_rng(2).standard_normal((7, 7))
    A = size * (draw - draw.T - np.eye(7)) / 7.0
    assert np.abs(exponential(A) - scipy.linalg.expm(A)).max() < SAME_EXPONENTIAL
