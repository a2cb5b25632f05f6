"""Step and frequency response against python-control, and their final values."""

from __future__ import annotations

import control
import numpy as np
import pytest
import scipy

from flexgui.core.challenge.challenge_rig import bare_model
from flexgui.core.diagnose.force_shape_refinement import spectrum, spectrum_of_error
from flexgui.core.drives.torque import Torque
from flexgui.core.missing_torque import FIRST_FREQUENCY
from flexgui.core.model import Model
from flexgui.core.simulate.batch import run
from flexgui.core.simulate.disturbance import estimate_torque, torque_answer
from flexgui.core.simulate.linear import respond
from flexgui.core.simulate.motion import Task
from flexgui.core.simulate.posture import Posture, posture
from flexgui.core.simulate.response import (
    default_output,
    frequency_grid,
    frequency_response,
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


def test_a_resonance_is_hit_at_its_peak() -> None:
    """A peak narrower than the even grid's spacing is not lost."""
    here = posture(Model(ARMS["one mode"], Torque()), np.array([0.0]))
    grid = frequency_grid(here.poles)
    resonance = np.abs(here.poles.imag).max() / (2.0 * np.pi)
    assert np.abs(grid / resonance - 1.0).min() < SAME_GAIN
    assert np.all(np.diff(grid) > 0.0)


UNDAMPED = [
    ("1-1", Torque()), ("2-2", Torque()), ("one mode", Torque()), ("rigid pair", Torque()),
]  # fmt: skip


@pytest.mark.parametrize(("name", "drive"), UNDAMPED)
def test_an_undamped_pole_is_a_gap_and_all_else_agrees_with_control(
    name: str, drive: Torque
) -> None:
    arm = ARMS[name]
    here = posture(Model(arm, drive), np.resize(JOINTS, arm.joints))
    at_poles = np.abs(vibrations(here)) / (2.0 * np.pi)
    asked = np.unique(np.concatenate([[0.0], np.logspace(-1.0, 3.0, 40), at_poles]))
    found = frequency_response(here, "encoder", asked)
    gaps = np.isnan(found.gain).all(axis=(1, 2))
    assert not np.isinf(found.gain).any()
    assert asked[gaps] == pytest.approx([0.0, *at_poles], rel=SAME_GAIN)  # joints integrate
    known = system(here, "encoder")(2j * np.pi * asked[~gaps], squeeze=False)
    expected = np.moveaxis(known, -1, 0)
    assert np.all(np.abs(expected - found.gain[~gaps]) <= SAME_GAIN * np.abs(expected).max(axis=0))


def vibrations(here: Posture) -> np.ndarray:
    """rad/s of the free vibrations, from the energies alone: M q'' + K q = 0, slowest first."""
    squares = scipy.linalg.eigh(here.K, here.M, eigvals_only=True)
    return np.sqrt(squares[squares > SAME_GAIN * squares.max()])


def test_an_undamped_peak_is_drawn_on_both_sides() -> None:
    """The curve rises to it and is left open at the pole."""
    here = posture(Model(ARMS["1-1"], Torque()), JOINTS)
    found = frequency_response(here, "ydot")
    for pole in vibrations(here) / (2.0 * np.pi):
        k = int(np.flatnonzero(np.isclose(found.frequency, pole, rtol=SAME_GAIN))[0])
        beside = np.linalg.norm(found.gain[k - 2 : k + 3], axis=(1, 2))
        assert np.isnan(beside[2])
        assert beside[0] < beside[1] and beside[3] > beside[4]


def test_an_undamped_arm_still_has_a_length_of_time_to_show() -> None:
    here = posture(Model(ARMS["one mode"], Torque()), np.array([0.0]))
    found = step_response(here)
    slowest = np.abs(here.poles.imag).max() / (2.0 * np.pi)
    assert 1.0 / slowest < found.time[-1] < 100.0 / slowest
    assert np.all(np.isfinite(found.values))


@pytest.mark.parametrize(
    ("name", "kind"),
    [("1-1", "ydot"), ("slide", "deflection"), ("rigid pair", "ydot"), ("one mode", "deflection")],
)
def test_the_output_suits_the_arm(name: str, kind: str) -> None:
    here = at(name)
    assert default_output(here.model) == kind
    found = step_response(here)
    assert found.values.shape[1:] == (len(found.outputs), len(found.references))


def test_a_drive_with_states_is_part_of_the_response() -> None:
    here = posture(Model(loaded(ARMS["1-1"]), FILTERED), JOINTS)
    found = frequency_response(here, "encoder")
    expected = system(here, "encoder")(2j * np.pi * found.frequency)
    miss = np.abs(np.moveaxis(expected, -1, 0)[:, :, :2] - found.gain).max()
    assert miss < SAME_GAIN * np.abs(found.gain).max()


DT, N = 1e-3, 1500
NOISE = {"theta1": 2e-5, "theta2": 2e-5, "z1": 3e-5, "z2": 3e-5}
"""rad and m: a good encoder and a good camera."""

SHAPE = 0.97
"""Least correlation of the torque that is found with that which was there: corners are round."""

SIZE = 0.05
"""Relative, of its level."""


BAND = slice(0, 12)
"""To 10 Hz: above, the noise is heard."""

MIXED = 0.3
"""Relative: the window changes over 1.5 s / 2 pi, the loop forgets within 0.06 s."""


@pytest.fixture(scope="module")
def friction():
    """Errors (N, 4) that a known torque at the joints makes, and the torque (N, 2)."""
    model = bare_model()
    at = posture(model, np.array([0.0, 1.2]))
    time = DT * np.arange(N)
    torque = np.column_stack(
        [1.2 * np.sign(np.sin(9.0 * time)), 0.4 * np.sign(np.sin(14.0 * time + 1.0))]
    )
    # The velocity loop turns a torque into a reference: u = Λ (r - θ').
    law = at.numbers.law
    references = np.linalg.solve(law.R, torque.T).T
    n = model.arm.coordinates
    start = np.concatenate([at.q, np.zeros(n + law.states)])
    motion = run(model, at.numbers, Task(time, references, start, at.q[None, :]), 4)
    still, _ = model.compiled.tip_place(at.q, at.numbers.p)
    rng = np.random.default_rng(3)
    clean = np.column_stack([motion.joint_positions - at.q[:2], motion.tip()[0] - still])
    return at, clean + rng.standard_normal(clean.shape) * list(NOISE.values()), torque


def test_a_known_torque_is_found_again(friction) -> None:
    at, error, torque = friction
    found = estimate_torque(at, list(NOISE), error, list(NOISE.values()), DT)
    assert found is not None
    for k in range(2):
        assert np.corrcoef(found.torque[:, k], torque[:, k])[0, 1] > SHAPE
        level = np.median(np.abs(found.torque[:, k]))
        assert level == pytest.approx(np.abs(torque[:, k]).max(), rel=SIZE)


def test_encoders_alone_suffice_and_a_chosen_agility_is_kept(friction) -> None:
    at, error, torque = friction
    found = estimate_torque(at, ["theta1", "theta2"], error[:, :2], [2e-5, 2e-5], DT, 10.0)
    assert found is not None and found.agility == 10.0
    assert np.corrcoef(found.torque[:, 0], torque[:, 0])[0, 1] > 0.9


def test_noise_alone_needs_no_torque(friction) -> None:
    at, error, torque = friction
    noise = np.random.default_rng(4).standard_normal(error.shape) * list(NOISE.values())
    found = estimate_torque(at, list(NOISE), noise, list(NOISE.values()), DT)
    assert found is not None
    assert np.abs(found.torque).max() < 0.1 * np.abs(torque).max()


def test_an_output_that_is_not_of_the_motion_is_no_use(friction) -> None:
    at, error, _ = friction
    assert estimate_torque(at, ["i1"], error[:, :1], [1.0], DT) is None


def test_the_answer_to_a_torque_is_that_of_the_simulated_arm(friction) -> None:
    at, error, torque = friction
    known, answer = torque_answer(at, [*NOISE, "i1"], DT, np.fft.rfftfreq(N)[FIRST_FREQUENCY:])
    assert known == [0, 1, 2, 3]
    heard = spectrum_of_error(error)[BAND]
    expected = np.einsum("fkj,fj->fk", answer, spectrum(torque))[BAND]
    for h, x in zip(heard.T, expected.T, strict=True):
        assert np.linalg.norm(h - x) < MIXED * np.linalg.norm(x)
