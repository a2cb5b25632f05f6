"""simulate() by default: as exact as the modes are, and what the modes leave out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexgui.core.arm.arm import Arm
from flexgui.core.effects import catalogue
from flexgui.core.model import Model
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.simulate.experiment import make_task
from flexgui.core.simulate.modal_truncation import StraightArm, left_out
from flexgui.core.simulate.motion import Task, at_rest
from flexgui.core.simulate.nonlinear import DEFAULT_TOLERANCE, Simulated, simulate, simulate_within
from tests.helpers import ARMS, EVERY_ARM, PAPER, loaded, looped, with_modes
from tests.mujoco import simulate as chain
from tests.mujoco.chain import PAPER as BEAMS
from tests.mujoco.chain import Plant
from tests.mujoco.excitation import SAMPLE, prbs

ROUNDING = 1e-11
"""Relative: both sum the same polynomials, in another order."""

SHORT = 1e-4
"""s of one step."""

STEP_ROUNDING = 1e-9
"""Relative: the exponential squares rounding errors some twenty times."""

FACTOR = 2.0
"""Between what the modes are said to leave out and the tip's true error."""

TIGHT = 1e-6
"""m: the references' own integration error, a tenth of the smallest error that is judged."""

GRAVITY = (0.0, -9.81)
SECONDS = 0.6


def rms(distance: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(distance**2, axis=1))))


def missing(model: Model, task: Task, found: Simulated) -> float:
    """Rms of the tip in m that the modes leave out."""
    return rms(left_out(model, model.numbers(), task, found.trajectory.joint_positions))


def with_effect(kind: str) -> Model:
    return looped(PAPER).with_effects([catalogue()[kind]])


EFFECTS = ("joint_elasticity", "base_compliance")
MODELS = {name: looped(loaded(arm, GRAVITY), 10.0) for name, arm in ARMS.items()}
MODELS |= {kind: with_effect(kind) for kind in EFFECTS}


@pytest.mark.parametrize("name", [*EVERY_ARM, *EFFECTS])
def test_the_straight_arm_has_inertia_weight_and_tip_of_the_equations(
    name: str,
) -> None:
    model, numbers = MODELS[name], MODELS[name].numbers()
    joints = np.array([0.3, -0.8, 0.5])[: model.arm.joints]
    q = at_rest(joints, model.arm.coordinates)[: model.arm.coordinates]
    straight = StraightArm(model, numbers, joints, extra=0)
    M, force = model.compiled.mass_and_force(q, np.zeros_like(q), numbers.p)
    size = np.abs(M).max()
    assert np.abs(straight.M - M).max() < ROUNDING * size
    assert np.abs(straight.weight - force).max() < ROUNDING * max(np.abs(force).max(), 1.0)
    slopes = model.compiled.tip_place(q, numbers.p)[1]
    assert np.abs(straight.tip[: len(q)].T - slopes).max() < ROUNDING


def test_the_added_mode_is_that_of_an_arm_that_has_it() -> None:
    joints = np.array([0.2, 1.1])
    less, more = looped(with_modes(2, 2)), looped(with_modes(3, 3))
    widened = StraightArm(less, less.numbers(), joints, extra=1)
    plain = StraightArm(more, more.numbers(), joints, extra=0)
    order = np.array([0, 1, 2, 3, 5, 6, 4, 7])  # in the widened arm the added modes stand last
    assert np.abs(widened.M - plain.M[np.ix_(order, order)]).max() < ROUNDING
    rows = np.concatenate([order, 8 + order])
    over, expected = widened.step(SHORT)[:16, :], plain.step(SHORT)[np.ix_(rows, rows)]
    assert np.abs(over - expected).max() < STEP_ROUNDING * np.abs(expected).max()


def soft(arm: Arm) -> Arm:
    segments = tuple(s.model_copy(update={"EI": 200.0}) for s in arm.segments)
    return arm.model_copy(update={"segments": segments})


MOTIONS = {
    "plain binary": (lambda a: a, SimulateSpec(theta2=1.2, excitation="prbs")),
    "loaded, falling": (lambda a: loaded(a, GRAVITY), SimulateSpec(theta2=1.2)),
    "soft": (soft, SimulateSpec(theta2=1.8)),
    "swept": (lambda a: a, SimulateSpec(sweep=(0.4, 2.7))),
    "chirp": (lambda a: a, SimulateSpec(theta2=0.8, excitation="chirp")),
}


@pytest.mark.parametrize("modes", [1, 2])
@pytest.mark.parametrize("motion", MOTIONS)
def test_what_the_modes_leave_out_is_the_distance_to_a_finer_beam(motion: str, modes: int) -> None:
    change, spec = MOTIONS[motion]
    spec = spec.model_copy(update={"seconds": SECONDS, "seed": 3})
    model, fine = (looped(change(with_modes(m, m))) for m in (modes, 3))
    task = make_task(model, spec, "x")[0]
    found = simulate(model, model.numbers(), task)
    truth = simulate_within(fine, fine.numbers(), make_task(fine, spec, "x")[0], TIGHT)
    true = rms(found.trajectory.tip()[0] - truth.trajectory.tip()[0])
    assert true / FACTOR < missing(model, task, found) < true * FACTOR


def beam_tip(references: np.ndarray, theta2: float) -> np.ndarray:
    """The converged chain's tip: extrapolated over the hinges, whose error falls with their
    square."""
    tips = []
    for hinges, step in ((10, SAMPLE / 128), (20, SAMPLE / 256)):
        beams = tuple(replace(b, hinges=hinges) for b in BEAMS)
        tips.append(chain.run(Plant(beams=beams), theta2, references, step).tip)
    return np.asarray((4.0 * tips[1] - tips[0]) / 3.0)


def test_three_modes_leave_out_their_distance_to_an_independent_engine() -> None:
    references, model = prbs(0.4, seed=1), looped(with_modes(3, 3))
    start = at_rest(np.array([0.0, 1.2]), model.arm.coordinates)
    time = SAMPLE * np.arange(len(references))
    task = Task(time, references, start, start[None, : model.arm.coordinates])
    found = simulate(model, model.numbers(), task)
    true = rms(found.trajectory.tip()[0] - beam_tip(references, 1.2))
    assert true / FACTOR < missing(model, task, found) < true * FACTOR


def paper_task(model: Model) -> Task:
    return make_task(model, SimulateSpec(theta2=1.2, seconds=SECONDS, seed=3), "x")[0]


def test_stated_noise_above_what_the_modes_leave_out_saves_steps() -> None:
    model = looped(with_modes(3, 3))
    task, numbers = paper_task(model), model.numbers()
    plain, noisy = simulate(model, numbers, task), simulate(model, numbers, task, noise=1e-3)
    assert noisy.substeps < plain.substeps
    assert noisy.error > plain.error


def test_one_worker_and_two_find_the_same() -> None:
    model = looped(with_modes(2, 2))
    task, numbers = paper_task(model), model.numbers()
    one, two = (simulate(model, numbers, task, workers=w) for w in (1, 2))
    assert np.array_equal(one.trajectory.q, two.trajectory.q)


def test_an_arm_that_does_not_bend_is_simulated_within_the_tolerance() -> None:
    model = looped(with_modes(0, 0))
    task = paper_task(model)
    found = simulate(model, model.numbers(), task)
    assert found.error <= DEFAULT_TOLERANCE
    assert not left_out(model, model.numbers(), task, found.trajectory.joint_positions).any()
