"""The fast linear response against SciPy, lane by lane and side by side."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import cont2discrete, lsim

from flexgui.core.drives.servo import FollowingServo
from flexgui.core.drives.torque import Torque
from flexgui.core.lanes.wide import LANES
from flexgui.core.model import Model, Numbers
from flexgui.core.simulate.discrete import exponential
from flexgui.core.simulate.linear import respond
from flexgui.core.simulate.motion import Task
from flexgui.core.trajectory import Trajectory
from tests.helpers import (
    ARMS,
    loaded,
    looped,
    simulate_fixed,
    state_matrices,
    straight,
    task_from,
)
from tests.simulate.test_linear_model import FILTERED

AGREEMENT = 1e-9
"""Relative to the largest value of each state: exact discretisations, so only rounding."""

SAME = 1e-11
"""Relative: the neighbours in the lanes decide the squarings, which moves roundings."""

JOINTS = np.array([0.3, 1.2])


def levels(samples: int, seed: int, nr: int = 2) -> np.ndarray:
    """References (N, nr) that jump every five samples."""
    rng = np.random.default_rng(seed)
    return np.repeat(rng.uniform(-0.3, 0.3, (-(-samples // 5), nr)), 5, axis=0)[:samples]


def start_of(model: Model, joints: np.ndarray = JOINTS, seed: int = 1) -> np.ndarray:
    n, states = model.arm.coordinates, model.numbers().law.states
    rng = np.random.default_rng(seed)
    start = np.concatenate([straight(joints, model.arm), np.zeros(n + states)])
    start[n : n + 2] = rng.uniform(-0.2, 0.2, 2)
    return start


def states_of(motion: Trajectory) -> np.ndarray:
    return np.hstack([motion.q, motion.v])


def assert_same_motion(found: np.ndarray, expected: np.ndarray, tolerance: float) -> None:
    size = np.abs(expected).max(axis=0)
    assert np.all(np.abs(found - expected).max(axis=0) <= tolerance * size)


def held_response(model: Model, numbers: Numbers, task: Task, joints: np.ndarray) -> np.ndarray:
    """x (N, 2 n + ns) by SciPy's exact discretisation of held references."""
    A, B = state_matrices(model, numbers, joints)
    none = np.zeros((1, len(A))), np.zeros((1, B.shape[1]))
    Ad, Bd, *_ = cont2discrete((A, B, *none), task.sample_time, method="zoh")
    x = [task.start]
    for r in task.references[:-1]:
        x.append(Ad @ x[-1] + Bd @ r)
    return np.array(x)


@pytest.mark.parametrize("name", ["1-1", "3-3"])
def test_response_is_the_exact_one_for_held_references(name: str) -> None:
    model = looped(loaded(ARMS[name]))
    numbers, task = model.numbers(), task_from(model, start_of(model), levels(400, seed=2))
    motion = respond(model, [numbers], [task])[0]
    expected = held_response(model, numbers, task, JOINTS)
    assert_same_motion(states_of(motion), expected, AGREEMENT)


def test_states_of_a_drive_respond_exactly_and_its_torque_is_its_law() -> None:
    model = Model(loaded(ARMS["1-1"]), FILTERED)
    numbers, n = model.numbers(), 4
    task = task_from(model, start_of(model), levels(400, seed=3))
    motion = respond(model, [numbers], [task])[0]
    x, law = held_response(model, numbers, task, JOINTS), numbers.law
    assert_same_motion(states_of(motion), x[:, : 2 * n], AGREEMENT)
    torque = task.references @ law.R.T - x[:, :n] @ law.P.T - x[:, n : 2 * n] @ law.V.T
    torque -= x[:, 2 * n :] @ law.S.T
    assert_same_motion(motion.torque, torque, AGREEMENT)


def test_tasks_of_any_length_and_rate_side_by_side_are_as_one_by_one() -> None:
    """Eleven, so that they fill more than one round of lanes."""
    model = looped(loaded(ARMS["2-2"]))
    numbers = [model.numbers({"EI1": 400.0 + 20.0 * k, "lambda1": 50.0 + k}) for k in range(11)]
    tasks = [
        task_from(
            model, start_of(model, JOINTS + 0.1 * k, seed=k), levels(150 + 37 * k, seed=k),
            dt=1e-3 * (1 + k % 3),
        )
        for k in range(11)
    ]  # fmt: skip
    together = respond(model, numbers, tasks)
    for each, task, motion in zip(numbers, tasks, together, strict=True):
        alone = respond(model, [each], [task])[0]
        assert len(motion.q) == len(task.time)
        assert_same_motion(states_of(motion), states_of(alone), SAME)
        assert_same_motion(motion.torque, alone.torque, SAME)


def test_references_that_run_straight_are_as_scipy_interpolates_them() -> None:
    arm = loaded(ARMS["1-1"])
    servo = FollowingServo(Torque(), hz=60.0, inertia=(4.0, 1.0))
    model = Model(arm, Torque(), steering=servo)
    numbers = model.numbers()
    references = np.cumsum(levels(300, seed=5, nr=8), axis=0) * 0.01
    task = task_from(model, start_of(model), references)
    motion = respond(model, [numbers], [task])[0]
    A, B = state_matrices(model, numbers, JOINTS)
    system = (A, B, np.eye(8), np.zeros((8, 8)))
    _, expected, _ = lsim(system, references, task.time, X0=task.start, interp=True)
    assert_same_motion(states_of(motion), expected, AGREEMENT)


@pytest.mark.parametrize("name", ["1-1", "3-3"])
def test_a_schedule_that_does_not_move_is_the_constant_model(name: str) -> None:
    model = looped(loaded(ARMS[name]))
    numbers = model.numbers()
    task = task_from(model, start_of(model), levels(100, seed=6))
    path = np.repeat(task.schedule, len(task.time), axis=0)
    along = Task(task.time, task.references, task.start, path)
    constant, scheduled = respond(model, [numbers], [task]), respond(model, [numbers], [along])
    assert_same_motion(states_of(scheduled[0]), states_of(constant[0]), AGREEMENT)


def test_a_moving_and_a_resting_schedule_do_not_disturb_each_other() -> None:
    model = looped(loaded(ARMS["1-1"]))
    numbers = model.numbers()
    resting = task_from(model, start_of(model), levels(80, seed=7))
    path = np.repeat(resting.schedule, 120, axis=0)
    path[:, 1] += np.linspace(0.0, 0.5, 120)
    longer = task_from(model, start_of(model), levels(120, seed=8))
    moving = Task(longer.time, longer.references, longer.start, path)
    both = respond(model, [numbers, numbers], [resting, moving])
    for motion, task in zip(both, (resting, moving), strict=True):
        alone = respond(model, [numbers], [task])[0]
        assert_same_motion(states_of(motion), states_of(alone), AGREEMENT)


def test_a_moving_schedule_takes_the_model_in_the_middle_of_each_sample() -> None:
    model = looped(loaded(ARMS["1-1"]))
    numbers, task = model.numbers(), task_from(model, start_of(model), levels(6, seed=9))
    path = np.repeat(task.schedule, 6, axis=0)
    path[:, 1] += 0.1 * np.arange(6)
    motion = respond(model, [numbers], [Task(task.time, task.references, task.start, path)])[0]
    x = task.start
    for k in range(5):
        middle = 0.5 * (path[k, :2] + path[k + 1, :2])
        step = task_from(model, x, task.references[k : k + 2])
        x = held_response(model, numbers, step, middle)[1]
    assert_same_motion(states_of(motion)[-1:], x[None], AGREEMENT)


@pytest.mark.parametrize("name", ["1-1", "2-2"])
def test_non_linear_motion_tends_to_the_linear_one_with_the_amplitude(name: str) -> None:
    """Ten times less motion, ten times less relative difference."""
    model = looped(loaded(ARMS[name]))
    numbers, misses = model.numbers(), []
    start = np.concatenate([straight(JOINTS, model.arm), np.zeros(model.arm.coordinates)])
    for amplitude in (1.0, 0.1, 0.01):
        task = task_from(model, start, amplitude * levels(300, seed=10))
        true = states_of(simulate_fixed(model, numbers, task, 64))
        linear = states_of(respond(model, [numbers], [task])[0])
        moved = np.abs(linear - start[None]).max(axis=0)
        misses.append((np.abs(true - linear).max(axis=0) / moved).max())
    assert misses[1] < 0.2 * misses[0]
    assert misses[2] < 0.2 * misses[1]
    assert misses[2] < 2e-3


EXPM_AGREEMENT = 1e-12
"""Relative to the largest entry, for well-conditioned matrices."""

STIFF_AGREEMENT = 1e-9
"""Twenty squarings multiply roundings by the condition of the exponential."""


def exponentials(matrices: np.ndarray) -> np.ndarray:
    """exp of matrices (LANES, n, n)."""
    n = matrices.shape[1]
    columns = np.array(np.moveaxis(matrices, 0, -1).reshape(n * n, LANES), order="C")
    found = exponential(columns, n, np.empty((5, n * n, LANES)))
    return np.moveaxis(np.array(found).reshape(n, n, LANES), -1, 0)


def worst(matrices: np.ndarray) -> float:
    found = exponentials(matrices)
    exact = np.array([expm(A) for A in matrices])
    size = np.abs(exact).max(axis=(1, 2))
    return float((np.abs(found - exact).max(axis=(1, 2)) / size).max())


@pytest.mark.parametrize("n", [1, 2, 3, 5, 8, 13])
@pytest.mark.parametrize("norm", [1e-8, 0.1, 1.0, 10.0])
def test_random_matrices(n: int, norm: float) -> None:
    matrices = np.random.default_rng(n).standard_normal((LANES, n, n)) * norm / n
    assert worst(matrices) < EXPM_AGREEMENT


def test_stiff_matrices_with_poles_from_one_to_a_million() -> None:
    """Symmetric, so that the exponential itself is well conditioned."""
    rng = np.random.default_rng(3)
    matrices = []
    for _ in range(LANES):
        V, _ = np.linalg.qr(rng.standard_normal((6, 6)))
        matrices.append(V @ np.diag(-np.logspace(0.0, 6.0, 6) * 1e-3) @ V.T)
    assert worst(np.array(matrices)) < STIFF_AGREEMENT


def test_lanes_do_not_touch_each_other() -> None:
    """A stiff neighbour decides the squarings, not the result."""
    rng = np.random.default_rng(5)
    matrices = rng.standard_normal((LANES, 4, 4))
    matrices[1] = -np.diag([1.0, 1e2, 1e4, 1e5])
    assert worst(matrices) < STIFF_AGREEMENT
