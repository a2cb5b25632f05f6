"""What effects of segments, tip and base do to an arm."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from flexgui.core.arm.chord import deflection_rows
from flexgui.core.arm.presets import presets
from flexgui.core.drives.torque import Torque
from flexgui.core.drives.velocity_loop import VelocityLoop
from flexgui.core.effects import effect, with_included
from flexgui.core.effects.effect import Rig
from flexgui.core.effects.load_friction import LAW
from flexgui.core.forces.compiled import compile_law
from flexgui.core.model import Model
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.simulate.batch import run
from flexgui.core.simulate.experiment import make_task
from flexgui.core.simulate.nonlinear import difference, simulate_within
from tests.effects.helpers import experiment, with_effect
from tests.helpers import PAPER, looped, task_from, with_modes

NOTHING = np.zeros(0)


def test_an_extra_mode_can_be_added_until_there_are_three():
    mode = effect("extra_bending_mode")
    model = looped(PAPER)
    for times, modes in ((1, 2), (2, 3), (3, 3)):
        assert model.with_effects([mode] * times).arm.modes == (modes, modes)
    again = model.with_effects([mode]).with_effects([mode, mode])
    assert again.arm.modes == (3, 3)
    assert again.with_effects([]).arm.modes == (1, 1)


def test_other_effects_are_in_a_model_once():
    mode, friction = effect("extra_bending_mode"), effect("viscous_friction")
    kinds = [one.kind for one in with_included([friction, mode, friction, mode])]
    assert kinds == ["viscous_friction", "extra_bending_mode", "extra_bending_mode"]


@pytest.mark.parametrize(
    ("modes", "words"), [((3, 3), "3 modes already"), ((0, 0), "No segment"), ((0, 3), "already")]
)
def test_an_arm_with_all_modes_gets_no_other(modes, words):
    arm = with_modes(*modes)
    rig = Rig(arm, looped(arm).drive, "nonlinear", ("z",))
    assert words in effect("extra_bending_mode").not_applicable(rig)


def test_rigid_segments_stay_rigid_beside_an_extra_mode():
    model = looped(with_modes(0, 1)).with_effects([effect("extra_bending_mode")])
    assert model.arm.modes == (0, 2)


def test_large_motion_is_for_linear_models_only():
    motion = effect("large_motion")
    arm = PAPER
    assert not motion.not_applicable(Rig(arm, looped(arm).drive, "lpv", ("z",)))
    assert motion.not_applicable(Rig(arm, looped(arm).drive, "nonlinear", ("z",)))
    assert looped(arm, level="lpv").with_effects([motion]).level == "nonlinear"


def test_air_drag_pushes_against_the_tips_motion_with_the_square_of_its_speed():
    element = looped(PAPER).with_effects([effect("air_drag")], {"cd": 2.0}).numbers().elements[0]
    v = np.array([3.0, -4.0])
    found = compile_law(element.law)(np.zeros(2), v, NOTHING, np.array(element.values))[:2]
    assert found == pytest.approx(-2.0 * 5.0 * v, rel=1e-12)


def test_air_drag_is_finite_at_rest():
    element = looped(PAPER).with_effects([effect("air_drag")]).numbers().elements[0]
    rest = np.zeros(2)
    assert np.isfinite(compile_law(element.law)(rest, rest, NOTHING, np.array([2.0]))).all()


def test_cubic_stiffness_pushes_the_bent_end_back():
    model = looped(PAPER).with_effects([effect("cubic_stiffness")], {"k31": 5.0, "k32": 7.0})
    numbers = model.numbers()
    rows = deflection_rows(model.arm, numbers.p)
    for k, (element, size) in enumerate(zip(numbers.elements, (5.0, 7.0), strict=True)):
        assert np.array_equal(element.directions[0], rows[k])
        x = np.array([0.1])
        values = np.array(element.values)
        force = compile_law(element.law)(x, np.zeros(1), NOTHING, values)[0]
        assert force == pytest.approx(-size * 0.1**3, rel=1e-12)


def test_a_soft_base_lets_the_tip_move_as_soft_as_it_is():
    """At the end of a long static pull of the tilted arm's weight."""
    weight = (PAPER.segments[0].mass + PAPER.segments[1].mass) * 0.2
    effects = [effect("base_compliance"), effect("gravity_tilt")]
    model = looped(PAPER).with_effects(effects, {"cb": 1e-5, "g1": 0.0, "g2": 0.2})
    task, _ = make_task(model, SimulateSpec(theta2=1.0, seconds=2.0, amplitude=1e-9), "r")
    base = simulate_within(model, model.numbers(), task).trajectory.q[:, -2:]
    # The base swings around where it settles; nothing damps its own motion.
    assert base.mean(axis=0)[1] == pytest.approx(1e-5 * weight, rel=0.05)
    assert abs(base.mean(axis=0)[0]) < 0.05 * 1e-5 * weight


def test_a_payload_is_the_mass_at_the_tip_of_the_arm():
    model = looped(PAPER).with_effects([effect("tip_payload")], {"mt2": 0.7})
    segments = (PAPER.segments[0], PAPER.segments[1].model_copy(update={"tip_mass": 0.7}))
    other = looped(PAPER.model_copy(update={"segments": segments}))
    assert np.array_equal(model.numbers().p, other.numbers().p)


SLIDE = presets()["single_axis"]
MASS = SLIDE.segments[0].mass
"""kg"""
SHARES = {"ld1": 0.2, "ld2": 0.2, "lb1": 0.1, "lb2": 0.1}


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


BASE = looped(PAPER)

ORDER = 1.6
"""The method is of second order; a friction that turns round costs some of it."""


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
