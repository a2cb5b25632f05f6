"""Friction that grows with the transmitted torque: levels, direction, order, and a whole motion."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from flexgui.core.arm.presets import presets
from flexgui.core.drives.torque import Torque
from flexgui.core.drives.velocity_loop import VelocityLoop
from flexgui.core.effects import effect
from flexgui.core.effects.load_friction import LAW
from flexgui.core.forces.compiled import compile_law
from flexgui.core.model import Model
from flexgui.core.simulate.batch import run
from flexgui.core.simulate.nonlinear import difference, simulate_within
from tests.effects.helpers import experiment, with_effect
from tests.helpers import PAPER, looped, task_from

BASE = looped(PAPER)
SLIDE = presets()["single_axis"]
MASS = SLIDE.segments[0].mass
"""kg"""
SHARES = {"ld1": 0.2, "ld2": 0.2, "lb1": 0.1, "lb2": 0.1}

ORDER = 1.6
"""The method is of second order; a friction that turns round costs some of it."""

SLIDING = 2e-3
"""Of the motion: the bristle of a micrometre needs it until it slides."""

ENCODER = 1e-6
"""m: a tenth of what an encoder resolves."""


def force(torque: float, share: float, ld: float = 0.2, lb: float = 0.1) -> float:
    """Of the law with the bristle at a share of its level."""
    e = np.array([ld, lb, 1e-6, torque])
    return float(compile_law(LAW)(np.zeros(1), np.zeros(1), np.array([share]), e)[0])


@pytest.mark.parametrize(
    ("torque", "direction", "expected"),
    [(5.0, 1, -1.0), (-5.0, -1, 1.0), (5.0, -1, 0.5), (-5.0, 1, -0.5), (0.0, 1, 0.0)],
)
def test_it_takes_one_share_while_driving_and_another_while_braking(torque, direction, expected):
    assert force(torque, direction) == pytest.approx(expected)


def test_a_joint_without_torque_coasts_as_if_nothing_rubbed():
    base = looped(PAPER, gain=0.0)
    model = with_effect("load_friction", base, SHARES)
    start = np.zeros(2 * PAPER.coordinates)
    start[PAPER.coordinates] = 0.5
    task = task_from(base, start, np.zeros((200, 2)))
    motions = [run(m, m.numbers(), task, 8) for m in (base, model)]
    assert np.array_equal(motions[0].q, motions[1].q)


def test_its_sizes_cannot_be_negative():
    quantities = effect("load_friction").parameters(PAPER, BASE.drive, None)
    assert [k.parameter.name for k in quantities] == ["ld1", "ld2", "lb1", "lb2"]
    assert all(k.parameter.lower == 0.0 and k.parameter.upper < 1.0 for k in quantities)


def sliding(force: float, speed: float) -> float:
    """Acceleration of a slide of 10 kg with friction, under a constant force, at a speed."""
    model = Model(SLIDE, Torque()).with_effects([effect("load_friction")], {"ld1": 0.2, "lb1": 0.1})
    task = task_from(model, np.array([0.0, speed]), np.full((21, 1), force))
    motion = simulate_within(model, model.numbers(), task).trajectory
    return float((motion.v[-1, 0] - motion.v[0, 0]) / (task.time[-1] - task.time[0]))


@pytest.mark.parametrize(
    ("force", "speed", "share"), [(50.0, 2.0, 0.8), (-50.0, 2.0, 1.1), (50.0, -2.0, 1.1)]
)
def test_a_slide_gets_less_while_driven_and_is_helped_while_braked(force, speed, share):
    assert sliding(force, speed) == pytest.approx(share * force / MASS, rel=SLIDING)


def test_more_steps_move_the_motion_by_nearly_their_square():
    model = with_effect("load_friction", BASE, SHARES)
    task = experiment(model, seconds=0.2)

    def change(steps: int) -> float:
        return difference(*(run(model, model.numbers(), task, m * steps) for m in (1, 2)))

    assert np.log2(change(2) / change(64)) / np.log2(32.0) > ORDER


def test_a_whole_motion_agrees_with_the_equations_written_out():
    """A slide in a velocity loop, whose torque follows from its own speed."""
    gain, shares = 200.0, {"ld1": 0.3, "lb1": 0.15}
    model = Model(SLIDE, VelocityLoop(gains=(gain,)))
    model = model.with_effects([effect("load_friction")], shares)
    references = 0.5 * np.sign(np.sin(np.arange(400) / 30.0))[:, None]
    task = task_from(model, np.zeros(2), references)
    found = simulate_within(model, model.numbers(), task).trajectory.v[:, 0]

    def rate(t, y, r):  # type: ignore[no-untyped-def]
        v, w = y
        u = gain * (r - v)
        share = 0.3 if u * w > 0.0 else 0.15
        return [(u - share * abs(u) * w) / MASS, (v - abs(v) * w) / 1e-6]

    dt, states = task.sample_time, [np.zeros(2)]
    for r in references[:-1, 0]:
        solved = solve_ivp(
            rate, (0.0, dt), states[-1], args=(r,), method="Radau", rtol=1e-8, atol=1e-10
        )
        states.append(solved.y[:, -1])
    expected = np.array(states)[:, 0]
    assert np.abs(found - expected).max() < SLIDING * np.abs(expected).max()


def test_beside_coulomb_friction_their_levels_add_up():
    """Two bristles at one joint that bend alike, held and slipping."""
    for pull in (7.0, 8.3, 9.5):
        task = task_from(Model(SLIDE, Torque()), np.zeros(2), np.full((200, 1), pull))
        both = {"fc1": 6.0, "ld1": 0.3, "lb1": 0.3}
        found, expected = (
            place_at_the_end([effect(kind) for kind in kinds], sizes, task)
            for kinds, sizes in (
                (("coulomb_friction", "load_friction"), both),
                (("coulomb_friction",), {"fc1": 6.0 + 0.3 * pull}),
            )
        )
        assert found == pytest.approx(expected, rel=SLIDING, abs=ENCODER)


def place_at_the_end(effects, sizes, task) -> float:  # type: ignore[no-untyped-def]
    model = Model(SLIDE, Torque()).with_effects(effects, sizes)
    return float(simulate_within(model, model.numbers(), task).trajectory.q[-1, 0])
