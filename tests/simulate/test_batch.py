"""Simulations side by side give what each gives alone, and none is worked out with weak pivots."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numba import njit

from flexgui.core.arm.build import build_arm
from flexgui.core.drives import build_drive
from flexgui.core.effects import catalogue
from flexgui.core.lanes import functions
from flexgui.core.model import Model
from flexgui.core.progress import Silent, counted_simulations
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.scenario.schema import ArmSpec
from flexgui.core.simulate import batch
from flexgui.core.simulate.batch import Job, run, run_many
from flexgui.core.simulate.experiment import make_task
from flexgui.core.simulate.rosenbrock import GAMMA
from tests.helpers import task_from, with_modes

ROUNDING = 1e-9
"""rad or m after some hundred steps: sums are taken in another order, and that is all."""

SINE_ROUNDING = 4e-16
"""Two units in the last place of a number up to one."""

EXPONENTIAL_ROUNDING = 4.5e-16
"""Relative: two units in the last place."""

EFFECTS = (
    (), ("viscous_friction",), ("coulomb_friction",), ("stribeck_friction",),
    ("presliding_friction",), ("joint_elasticity",), ("tip_payload",), ("structural_damping",),
    ("torque_ripple",), ("backlash",), ("drive_lag",), ("air_drag",), ("base_compliance",),
    ("cubic_stiffness",),
    ("load_friction",), ("friction_asymmetry",), ("coulomb_friction", "drive_lag"),
)  # fmt: skip
UNEQUAL, SHARED = (2, 1), (1, 1)
ADDING = {"joint_elasticity", "backlash", "base_compliance"}
"""They bring coordinates of their own: with SHARED modes these are structures that every diagnosis
compiles, with others it takes ten seconds for each."""


def jobs_of(kinds: tuple[str, ...], count: int, modes: tuple[int, int] = UNEQUAL) -> list[Job]:
    arm = build_arm(ArmSpec(preset="paper", modes=modes))
    bare = Model(arm, build_drive("velocity_loop", {"gains": [60.0, 30.0]}), "nonlinear")
    model = bare.with_effects([catalogue()[kind] for kind in kinds])
    found = []
    for k in range(count):
        spec = SimulateSpec(theta2=0.4 + 0.3 * k, seconds=0.2 + 0.02 * (k % 3), seed=k)
        task, _ = make_task(model, spec, "x")
        numbers = model.numbers({"EI1": 300.0 + 40.0 * k, "EI2": 520.0})
        found.append(Job(model, numbers, task))
    return found


@pytest.mark.parametrize("kinds, modes", [
    *[(kinds, SHARED if ADDING & set(kinds) else UNEQUAL) for kinds in EFFECTS],
    *[
        pytest.param((kind,), UNEQUAL, marks=pytest.mark.long) for kind in sorted(ADDING)
    ],
])  # fmt: skip
def test_many_simulations_at_once_are_those_of_each_alone(
    kinds: tuple[str, ...], modes: tuple[int, int]
) -> None:
    jobs = jobs_of(kinds, 5, modes)
    for job, found in zip(jobs, run_many(jobs, 8), strict=True):
        alone = run(job.model, job.numbers, job.task, 8)
        assert found.q.shape == alone.q.shape
        scale = 1.0 + np.abs(alone.v).max()
        np.testing.assert_allclose(found.q, alone.q, atol=ROUNDING * scale)
        np.testing.assert_allclose(found.torque, alone.torque, atol=1e3 * ROUNDING * scale)


def test_a_torque_limit_is_kept_in_every_lane() -> None:
    jobs = jobs_of((), 8)
    limit = np.array([6.0, 3.0])
    jobs = [
        replace(j, numbers=j.numbers._replace(law=replace(j.numbers.law, limit=limit)))
        for j in jobs
    ]
    for motion in run_many(jobs, 16, workers=2):
        assert np.abs(motion.torque).max(axis=0) == pytest.approx(limit)


class Counting(Silent):
    """Adds up the simulations that it gets."""

    def __init__(self) -> None:
        self.number = 0

    def simulated(self, n: int) -> None:
        self.number += n


@pytest.mark.parametrize("workers", [1, 2])
def test_every_simulation_of_every_thread_is_counted(workers: int) -> None:
    jobs, counting = [*jobs_of((), 9), *jobs_of(("coulomb_friction",), 4)], Counting()
    with counted_simulations(counting, every=0.0):
        run_many(jobs, 4, workers=workers)
    assert counting.number == len(jobs)
    run_many(jobs, 4, workers=workers)
    assert counting.number == len(jobs), "nobody counts outside"


def test_jobs_of_several_structures_come_back_in_their_order() -> None:
    mixed = [*jobs_of((), 4), *jobs_of(("coulomb_friction",), 4), *jobs_of((), 9)]
    for job, found in zip(mixed, run_many(mixed, 4, workers=2), strict=True):
        assert found.p is job.numbers.p
        assert len(found.time) == len(job.task.time)


@pytest.mark.parametrize("kinds", [(), ("coulomb_friction",), ("drive_lag",)], ids="+".join)
def test_a_motion_does_not_depend_on_what_runs_beside_it(kinds: tuple[str, ...]) -> None:
    jobs = jobs_of(kinds, 5)
    together = run_many(jobs, 4)
    for k, found in enumerate(together):
        first, _ = run_many([jobs[k], jobs[k - 1]], 4)
        assert np.array_equal(found.q, first.q)
        assert np.array_equal(found.torque, first.torque)


def weakened() -> Job:
    """A rigid arm whose second joint is driven so that the last pivot of the first step's matrix
    vanishes at one step per sample."""
    arm = with_modes(0, 0)
    model = Model(arm, build_drive("velocity_loop", {"gains": [60.0, 30.0]}), "nonlinear")
    task = task_from(model, np.array([0.0, 1.0, 0.1, 0.0]), np.zeros((4, 2)))
    numbers = model.numbers()
    M = model.compiled.mass_matrix(task.start[:2], numbers.p)
    g = GAMMA * task.sample_time
    V = numbers.law.V.copy()
    V[1, 1] = (M[0, 1] ** 2 / (M[0, 0] + g * V[0, 0]) - M[1, 1]) / g
    return Job(model, numbers._replace(law=replace(numbers.law, V=V)), task)


def test_where_a_pivot_vanishes_the_steps_are_doubled() -> None:
    weak = weakened()
    jobs = [weak, replace(weak, numbers=weak.model.numbers()), weak]
    again, beside, third = run_many(jobs, 1)
    finer, other, _ = run_many(jobs, 2)
    assert np.isfinite(again.q).all() and np.array_equal(again.q, finer.q)
    assert np.array_equal(third.q, finer.q)
    assert not np.array_equal(beside.q, other.q)


def test_where_all_pivots_stay_weak_the_motion_is_no_number(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(batch, "WEAK_PIVOT", 1.0)
    job = weakened()
    assert np.isnan(run(*job.parts, 1).q).all()


def test_wide_sine_and_cosine_are_those_of_each_lane() -> None:
    @njit
    def evaluate(x, s, c):  # type: ignore[no-untyped-def]
        for i in range(x.shape[0]):
            functions.put(s, i, functions.sin(functions.get(x, i)))
            functions.put(c, i, functions.cos(functions.get(x, i)))

    x = np.random.default_rng(1).normal(0.0, 40.0, (500, 8))
    x[0] = np.arange(8) * np.pi / 4.0
    s, c = np.empty_like(x), np.empty_like(x)
    evaluate(x, s, c)
    np.testing.assert_allclose(s, np.sin(x), rtol=0.0, atol=SINE_ROUNDING)
    np.testing.assert_allclose(c, np.cos(x), rtol=0.0, atol=SINE_ROUNDING)


def test_the_wide_exponential_is_that_of_each_lane_to_the_ends_of_the_doubles() -> None:
    @njit
    def evaluate(x, e):  # type: ignore[no-untyped-def]
        for i in range(x.shape[0]):
            functions.put(e, i, functions.exp(functions.get(x, i)))

    rng = np.random.default_rng(2)
    x = np.vstack([rng.normal(0.0, 2.0, (300, 8)), rng.uniform(-708.0, 709.0, (300, 8))])
    found, ends = np.empty_like(x), np.empty((1, 8))
    evaluate(x, found)
    np.testing.assert_allclose(found, np.exp(x), rtol=EXPONENTIAL_ROUNDING)
    evaluate(np.array([[0.0, -0.0, 710.0, -745.2, np.inf, -np.inf, np.nan, 1.0]]), ends)
    assert ends[0, :6].tolist() == [1.0, 1.0, np.inf, 0.0, np.inf, 0.0]
    assert np.isnan(ends[0, 6]) and ends[0, 7] == pytest.approx(np.e, rel=EXPONENTIAL_ROUNDING)
