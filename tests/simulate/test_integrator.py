"""The integrator: its order, its stated error, its stability, the drive's limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from flexgui.core.drives.velocity_loop import VelocityLoop
from flexgui.core.excitation import build_excitation
from flexgui.core.model import Model
from flexgui.core.simulate.batch import run
from flexgui.core.simulate.motion import Task
from flexgui.core.simulate.nonlinear import (
    DEFAULT_TOLERANCE,
    difference,
    simulate_within,
)
from flexgui.core.simulate.rosenbrock import IMPLICIT, NODE, SHARES, STAGES
from flexgui.core.trajectory import Trajectory
from tests.helpers import (
    LAMBDA,
    PAPER,
    loaded,
    looped,
    simulate_fixed,
    state_rate,
    task_from,
    with_modes,
)

ORDER_EXTRAPOLATED = 2.7
"""The extrapolation is of third order; what its slope must reach at least."""

TIP_AGREEMENT = 5e-6
"""m, with an independent integrator at the default tolerance of 1e-6 m."""


HOLD = 20
"""Samples; the reference integrator restarts where the reference jumps."""


ROUNDING = 1e-12
"""Of sums of a dozen products of order one; with a rank that is not full, of their square root."""

ERROR_PER_RADIAN = 1e-4
"""Of a vibration with 16 steps per period; two stages of this kind (ROS2) make 6e-3."""


def smooth_task(model: Model, samples: int = 301) -> Task:
    """A motion with constant references from a start that is not at rest."""
    n = model.arm.coordinates
    start = np.zeros(2 * n)
    start[:2], start[n : n + 2] = (0.3, 1.2), (1.0, -1.0)
    return task_from(model, start, np.tile([0.3, -0.2], (samples, 1)))


def prbs_task(model: Model, seconds: float, seed: int) -> Task:
    samples = round(seconds * 1000) + 1
    excitation = build_excitation("prbs", {"amplitude": 0.3, "hold": HOLD * 1e-3})
    references = excitation.signal(samples, 2, 1e-3, np.random.default_rng(seed))
    start = np.zeros(2 * model.arm.coordinates)
    start[1] = 1.2
    return task_from(model, start, references)


def reference_solution(model: Model, task: Task, method: str) -> Trajectory:
    """The same experiment by SciPy, hold by hold, to ten digits."""
    numbers, n = model.numbers(), model.arm.coordinates
    x, found = task.start, [task.start]
    for first in range(0, len(task.time) - 1, HOLD):
        last = min(first + HOLD, len(task.time) - 1)
        r = task.references[first]
        solved = solve_ivp(
            lambda _t, y, r=r: state_rate(model, numbers, y, r),
            (task.time[first], task.time[last]), x, method=method, rtol=1e-10, atol=1e-13,
            t_eval=task.time[first + 1 : last + 1],
        )  # fmt: skip
        found += list(solved.y.T)
        x = solved.y[:, -1]
    states = np.ascontiguousarray(found)
    motion = run(model, numbers, task, 1)
    return replace(
        motion,
        q=np.ascontiguousarray(states[:, :n]),
        v=np.ascontiguousarray(states[:, n : 2 * n]),
    )


def slopes(errors: list[float]) -> np.ndarray:
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


def forced_nodes() -> np.ndarray:
    """alpha_i: where in a step each stage evaluates the forces."""
    return np.where(np.arange(STAGES) > 0, NODE, 0.0)


def stability(z: np.ndarray) -> np.ndarray:
    """R(z) of y' = z y over one step."""
    stages = [np.linalg.solve(np.eye(STAGES) - x * IMPLICIT, np.ones(STAGES)) for x in z]
    return 1.0 + z * np.array([SHARES @ k for k in stages])


def test_forces_are_of_third_order_where_the_step_s_jacobian_is_exact() -> None:
    """Hairer and Wanner, Solving Ordinary Differential Equations II, (7.15)."""
    alpha, beta = forced_nodes(), IMPLICIT.sum(axis=1)
    conditions = (
        SHARES.sum(),
        SHARES @ alpha,
        SHARES @ beta,
        SHARES @ alpha**2,
        SHARES @ IMPLICIT @ beta,
    )
    assert conditions == pytest.approx((1.0, 1 / 2, 1 / 2, 1 / 3, 1 / 6), abs=ROUNDING)


def test_no_pole_on_the_left_grows_and_the_stiffest_vanish() -> None:
    angles, sizes = np.radians([90.0, 100.0, 135.0, 180.0]), np.logspace(-3, 6, 400)
    z = np.outer(np.exp(1j * angles), sizes).ravel()
    assert np.abs(stability(z)).max() <= 1.0 + ROUNDING
    assert abs(stability(np.array([-1e9]))[0]) < 1e-8


def test_what_damps_or_rubs_takes_energy_in_every_step() -> None:
    """Algebraic stability: shares b are positive, and b_i beta_ij + b_j beta_ji - b_i b_j is a
    positive semidefinite matrix (Hairer and Wanner, section IV.12)."""
    products = SHARES[:, None] * IMPLICIT
    assert SHARES.min() > 0.0
    assert np.linalg.eigvalsh(products + products.T - np.outer(SHARES, SHARES)).min() > -ROUNDING


def test_a_vibration_keeps_its_frequency_and_size() -> None:
    z = 2j * np.pi / np.array([16.0])
    assert abs(np.log(stability(z)[0]) - z[0]) / abs(z[0]) < ERROR_PER_RADIAN


ORDER_OF_ONE_PASS = 0.1
"""For any W the method is of second order; how far the measured slope may be from 2."""


def test_one_pass_is_of_second_order() -> None:
    model = looped(with_modes(1, 1))
    task, numbers = smooth_task(model), model.numbers()
    exact = simulate_fixed(model, numbers, task, 1024)
    errors = [difference(run(model, numbers, task, steps), exact) for steps in (8, 16, 32, 64)]
    assert slopes(errors) == pytest.approx(2.0, abs=ORDER_OF_ONE_PASS)


SMALL = 1e-4
"""rad/s: with references so small an arm is linear, and a step's matrix its whole slope."""

ORDER_WHERE_LINEAR = 2.8
"""Of third order; what the measured slope must reach at least."""


@pytest.mark.parametrize("straight", [True, False])
def test_one_pass_is_of_third_order_where_the_arm_is_linear(straight: bool) -> None:
    """Whether references run straight between samples or are held."""
    model = looped(with_modes(1, 1))
    numbers = model.numbers()
    numbers = numbers._replace(law=replace(numbers.law, interpolate=straight))
    time = np.arange(301) * 1e-3
    references = SMALL * np.column_stack([np.sin(20.0 * time), np.cos(30.0 * time) - 1.0])
    task = task_from(model, np.zeros(2 * model.arm.coordinates), references)
    exact = run(model, numbers, task, 256)
    errors = [difference(run(model, numbers, task, steps), exact) for steps in (2, 4, 8, 16)]
    assert slopes(errors).min() > ORDER_WHERE_LINEAR


def test_two_passes_extrapolated_are_of_third_order() -> None:
    model = looped(with_modes(1, 1))
    task, numbers = smooth_task(model), model.numbers()
    exact = simulate_fixed(model, numbers, task, 1024)
    steps = (4, 8, 16, 32)
    errors = [difference(simulate_fixed(model, numbers, task, s), exact) for s in steps]
    assert slopes(errors).min() > ORDER_EXTRAPOLATED


@pytest.mark.parametrize(
    ("method", "seconds"),
    [("DOP853", 0.4), pytest.param("Radau", 1.0, marks=pytest.mark.long)],
)
def test_prbs_motion_agrees_with_an_independent_integrator_within_the_stated_error(
    method: str, seconds: float
) -> None:
    """DOP853: explicit and of eighth order, so nothing in common with the method under test."""
    model = looped(with_modes(2, 2))
    task = prbs_task(model, seconds, seed=3)
    found = simulate_within(model, model.numbers(), task)
    exact = reference_solution(model, task, method)
    miss = np.abs(found.trajectory.tip()[0] - exact.tip()[0]).max()
    assert found.error <= DEFAULT_TOLERANCE
    assert miss < TIP_AGREEMENT
    assert difference(found.trajectory, exact) < found.error


@pytest.mark.parametrize("tolerance", [1e-4, 1e-5, 1e-6, 1e-7])
def test_stated_error_bounds_the_actual_error(tolerance: float) -> None:
    model = looped(with_modes(2, 2))
    task, numbers = prbs_task(model, 0.3, seed=4), model.numbers()
    found = simulate_within(model, numbers, task, tolerance)
    exact = simulate_fixed(model, numbers, task, 512)
    assert found.error <= tolerance
    assert difference(found.trajectory, exact) <= found.error


COARSEST = 3e-3
"""m or rad: what one step per sample may miss; an unstable pole of 1e5 rad/s would leave any
bound within a few samples."""


def test_three_modes_are_stable_at_one_step_per_millisecond() -> None:
    model = looped(with_modes(3, 3))
    task, numbers = prbs_task(model, 3.0, seed=5), model.numbers()
    coarse = run(model, numbers, task, 1)
    fine = simulate_within(model, numbers, task).trajectory
    assert difference(coarse, fine) < COARSEST


def test_restarting_in_the_middle_changes_nothing() -> None:
    model = looped(with_modes(1, 1))
    numbers, task = model.numbers(), smooth_task(model)
    whole = run(model, numbers, task, 4)
    middle = 100
    start = np.concatenate([whole.q[middle], whole.v[middle]])
    rest = run(model, numbers, task_from(model, start, task.references[middle:]), 4)
    assert np.abs(rest.q - whole.q[middle:]).max() < 1e-13  # rounding of angles of order 1


@pytest.mark.parametrize("solver", ["run", "simulate"])
def test_torque_limits_are_obeyed_and_reached(solver: str) -> None:
    limits = (4.0, 1.5)
    model = Model(with_modes(1, 1), VelocityLoop(gains=LAMBDA, limits=limits))
    task, numbers = prbs_task(model, 0.6, seed=6), model.numbers()
    if solver == "run":
        motion = run(model, numbers, task, 4)
    else:
        motion = simulate_within(model, numbers, task).trajectory
    largest = np.abs(motion.torque).max(axis=0)
    assert np.all(largest <= limits)
    assert largest == pytest.approx(limits)


def test_limits_that_are_never_met_change_nothing() -> None:
    arm = with_modes(1, 1)
    free = Model(arm, VelocityLoop(gains=LAMBDA))
    wide = Model(arm, VelocityLoop(gains=LAMBDA, limits=(1e6, 1e6)))
    task = prbs_task(free, 0.3, seed=7)
    motions = [run(m, m.numbers(), task, 4) for m in (free, wide)]
    assert np.array_equal(motions[0].q, motions[1].q)


def test_an_impossible_tolerance_ends_with_an_honest_error() -> None:
    model = looped(with_modes(1, 1))
    task = smooth_task(model, samples=31)
    found = simulate_within(model, model.numbers(), task, tolerance=0.0)
    assert found.error > 0.0


ENERGY_DRIFT = 1e-6
MOMENTUM_DRIFT = 1e-9
"""Relative to the start; the bounds that were asked for over ten seconds."""

EVERY = 20
"""Samples between two looks at the energy."""


def coast(
    model: Model, q: list[float], v: list[float], seconds: float, substeps: int
) -> Trajectory:
    """The motion from q and v with all references zero."""
    samples = round(seconds * 1000) + 1
    references = np.zeros((samples, model.arm.joints))
    task = task_from(model, np.array([*q, *v]), references)
    return simulate_fixed(model, model.numbers(), task, substeps)


def energy_and_momentum(motion: Trajectory) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Total energy, bending energy (J) and momentum of theta1 (N m s) at every EVERY-th sample."""
    K, _ = motion.compiled.linear_matrices(motion.q[0], motion.p)
    rows = []
    for q, v in zip(motion.q[::EVERY], motion.v[::EVERY], strict=True):
        momentum = motion.compiled.mass_matrix(q, motion.p) @ v
        bending = 0.5 * q @ K @ q
        rows.append((0.5 * v @ momentum + bending, bending, momentum[0]))
    total, bending, momentum = np.array(rows).T
    return total, bending, momentum


def drift(x: np.ndarray) -> float:
    return float(np.abs(x / x[0] - 1.0).max())


def test_undriven_arm_keeps_energy_and_momentum_for_ten_seconds() -> None:
    model = looped(PAPER, gain=0.0)
    motion = coast(model, [0.3, 1.2, 5e-5, -5e-5], [1.0, -0.5, 0.0, 0.0], 10.0, substeps=32)
    total, _, momentum = energy_and_momentum(motion)
    assert np.ptp(motion.q[:, 1]) > 2.0, "theta2 must move far for this to mean something"
    assert drift(total) < ENERGY_DRIFT
    assert drift(momentum) < MOMENTUM_DRIFT


def test_energy_is_kept_while_it_swings_between_bending_and_motion() -> None:
    """Much of the energy bends the links; 300 rad/s need short steps, so half a second."""
    model = looped(PAPER, gain=0.0)
    motion = coast(model, [0.3, 1.2, 0.01, -0.01], [0.1, 0.1, 0.0, 0.0], 0.5, substeps=128)
    total, bending, _ = energy_and_momentum(motion)
    assert bending.max() > 0.4 * total[0]
    assert drift(total) < ENERGY_DRIFT


def test_damping_and_loops_only_take_energy() -> None:
    arm = loaded(PAPER)
    start = ([0.3, 1.2, 0.02, -0.02], [2.0, -3.0, 0.0, 0.0])
    for model in (looped(arm, gain=0.0), looped(PAPER), looped(arm)):
        total, _, _ = energy_and_momentum(coast(model, *start, seconds=1.0, substeps=16))
        assert np.all(np.diff(total) < ROUNDING * total[0])
        assert total[-1] < 0.99 * total[0]


def test_a_coarse_pass_damps_rather_than_excites() -> None:
    """L-stable: where steps are too long for the vibration it dies out, it never grows."""
    model = looped(PAPER, gain=0.0)
    start = np.array([0.3, 1.2, 0.02, -0.02, 0.0, 0.0, 0.0, 0.0])
    motion = run(model, model.numbers(), task_from(model, start, np.zeros((2001, 2)), 0.005), 1)
    total, _, _ = energy_and_momentum(motion)
    assert np.all(np.isfinite(total))
    assert total.max() <= total[0] * (1.0 + 1e-3)  # the method's own error in its first steps
