"""Dry friction inside the integrator: it holds, it turns round in a step, it never overshoots."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp

from flexgui.core.effects.bristle import bristle_law
from flexgui.core.forces.element import Element
from flexgui.core.forces.law import ForceLaw, V, W, X
from flexgui.core.model import Model
from flexgui.core.simulate.batch import Job, run, simulate_lanes
from flexgui.core.simulate.nonlinear import simulate_within
from tests.forces.test_motion import AGAINST_SCIPY, DAMPER, at, excited, forced, reference_solution
from tests.helpers import ARMS, PAPER, looped, task_from
from tests.marks import long_except

F = sp.Symbol("f", positive=True)
DRY = bristle_law(F, (F,))
LEVELS = (1.5, 0.6)
"""N m: a tenth of the torque of the motions here."""


def rubbing(base: Model, way: float, levels: tuple[float, ...] = LEVELS) -> Model:
    joints = range(base.arm.joints)
    return forced(base, *[Element(DRY, (at(base.arm, k),), (levels[k], way)) for k in joints])


def shares(model: Model, task, substeps: int) -> np.ndarray:  # type: ignore[no-untyped-def]
    """(N, joints): the states of the bristles, which a trajectory does not carry."""
    job = Job(model, model.numbers(), task)
    states, _, _ = simulate_lanes([job], [job.elements()], substeps)
    return states[:, task.start.size :, 0]


@pytest.mark.parametrize("way", long_except((1e-3,), (1e-3, 1e-5)))
def test_bristles_agree_with_a_reference_solution(way: float) -> None:
    """Turn-rounds included."""
    model = rubbing(looped(PAPER), way)
    task = excited(model, 25)
    expected = reference_solution(model, task, 1e-8)[:, : PAPER.coordinates]
    motion = simulate_within(model, model.numbers(), task, 1e-7).trajectory
    assert np.abs(motion.q - expected).max() < AGAINST_SCIPY


def jerked(model: Model):  # type: ignore[no-untyped-def]
    """References that turn round within one sample, again and again, and rest at the end."""
    task = excited(model, 400)
    rng = np.random.default_rng(4)
    references = np.repeat(rng.uniform(-0.5, 0.5, (20, task.references.shape[1])), 20, axis=0)
    references[-100:] = 0.0
    return replace(task, references=references)


@pytest.mark.parametrize("way", [1e-4, 1e-6, 1e-9])
@pytest.mark.parametrize("substeps", [1, 8])
def test_shares_stay_within_one_however_hard_the_joint_is_turned_round(
    way: float, substeps: int
) -> None:
    model = rubbing(looped(PAPER), way)
    found = shares(model, jerked(model), substeps)
    assert np.isfinite(found).all()
    assert np.abs(found).max() <= 1.0
    assert np.abs(found).max() > 0.99


ENCODER = 1e-5
"""rad: what an encoder resolves; no choice of a method may be seen by one."""


def test_halving_the_step_moves_the_motion_by_less_each_time() -> None:
    model = rubbing(looped(ARMS["2-2"], gain=40.0), 1e-6)
    task, numbers = excited(model), model.numbers()
    motions = [run(model, numbers, task, s).q for s in (4, 8, 16, 32, 64)]
    moved = [np.abs(b - a).max() for a, b in zip(motions, motions[1:], strict=False)]
    assert moved[-1] < 0.2 * moved[0], moved
    assert moved[1] < ENCODER


def test_the_way_of_a_turn_round_is_all_that_is_seen_of_it() -> None:
    """A velocity loop does not take back what each turn-round leaves."""
    base = looped(PAPER)
    task = jerked(base)
    motions = [run(m, m.numbers(), task, 64).q for m in (rubbing(base, w) for w in (1e-6, 1e-9))]
    turns = 2 * len(np.flatnonzero(np.diff(task.references[:, 0])))
    assert np.abs(motions[0] - motions[1]).max() < turns * 1e-6


def pulled(torque: float, seconds: float = 2.0):  # type: ignore[no-untyped-def]
    """A bare arm whose first joint rubs at 1.5 N m and is pulled by a constant torque."""
    base = looped(PAPER, gain=0.0)
    pull = Element(ForceLaw((X,), (V,), (F,), (F,)), (at(PAPER, 0),), (torque,))
    calm = [Element(DAMPER, (at(PAPER, 1),), (5.0,))]
    model = forced(base, Element(DRY, (at(PAPER, 0),), (1.5, 1e-6)), pull, *calm)
    task = task_from(model, np.zeros(8), np.zeros((int(1e3 * seconds), 2)))
    return run(model, model.numbers(), task, 8)


def test_a_joint_pulled_by_less_than_its_level_stays_where_it_is() -> None:
    """A rounded sign of 5e-4 rad/s would creep by five hundred times as much."""
    assert np.abs(pulled(1.2).q[:, 0]).max() < 1e-5


def test_a_joint_pulled_by_more_than_its_level_goes() -> None:
    assert pulled(2.0).q[-1, 0] > 0.05


def test_two_bristles_at_a_joint_are_one_of_the_sum() -> None:
    base = looped(PAPER)
    task = jerked(base)
    twice = forced(base, *[Element(DRY, (at(PAPER, 0),), (f, 1e-6)) for f in (0.9, 0.6)])
    once = forced(base, Element(DRY, (at(PAPER, 0),), (1.5, 1e-6)))
    a, b = (run(m, m.numbers(), task, 8).q for m in (twice, once))
    assert np.abs(a - b).max() < 1e-9


def test_a_bristle_without_a_state_is_refused() -> None:
    with pytest.raises(ValueError, match="one port and one state"):
        ForceLaw((X,), (V,), (-F * V,), (F,), bristle=True)
    assert ForceLaw((X,), (V,), (-F * W,), (F,), (W,), (V,), bristle=True).bristle
