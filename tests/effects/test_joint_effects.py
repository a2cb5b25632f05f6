"""What each effect of joints and drives does, by routes of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from flexgui.core.arm.segment import Segment
from flexgui.core.arm.slots import HUB_INERTIA, TWIST_STIFFNESS, arm_vector, slot
from flexgui.core.drives import build_drive
from flexgui.core.drives.law import DriveLaw
from flexgui.core.effects import effect
from flexgui.core.effects.backlash import CONTACT_RATE
from flexgui.core.effects.drive_lag import lagged
from flexgui.core.effects.joint_load import LEAST_LOAD, joint_load
from flexgui.core.effects.torque_ripple import LAW as RIPPLE
from flexgui.core.forces.compiled import compile_law
from flexgui.core.model import Model
from flexgui.core.simulate.batch import run
from flexgui.core.simulate.nonlinear import difference, simulate_within
from tests.drives.test_contract import OPTIONS
from tests.effects.helpers import experiment, moved, with_effect
from tests.helpers import ARMS, PAPER, looped, simulate_fixed, task_from

BASE = looped(PAPER)


RIGID = 2e-5
"""rad: a breakaway of half of it is hardly seen."""


def power_free(model: Model, joint_speeds: np.ndarray) -> np.ndarray:
    """(N, joints): the elements' forces on the joints at given steady speeds, the arm straight."""
    found = np.zeros((len(joint_speeds), 2))
    for one in model.numbers().elements:
        row = one.rows(model.arm.coordinates)[0]
        law, e = compile_law(one.law), np.array(one.values)
        for i, v in enumerate(joint_speeds):
            speed = np.array([row[:2] @ v])
            slipping = np.sign(speed[: len(one.law.states)])
            found[i] += law(np.zeros(1), speed, slipping, e)[0] * row[:2]
    return found


def test_stribeck_peaks_at_the_sum_of_both_levels_and_falls_to_coulombs() -> None:
    sizes = {"fc1": 1.0, "fc2": 0.5, "fb1": 0.6, "fb2": 0.3, "vs1": 0.05, "vs2": 0.05}
    model = with_effect("stribeck_friction", BASE, sizes)
    slow = 0.005
    speeds = np.array([[slow, -slow], [1.0, -1.0]])
    near, far = power_free(model, speeds)
    bulge = np.exp(-((slow / 0.05) ** 2))
    assert near == pytest.approx([-1.0 - 0.6 * bulge, 0.5 + 0.3 * bulge])
    assert far == pytest.approx([-1.0, 0.5])


def test_asymmetry_points_the_same_way_in_both_directions() -> None:
    model = with_effect("friction_asymmetry", BASE, {"fa1": 0.4, "fa2": -0.2})
    forwards, backwards = power_free(model, np.array([[0.5, 0.5], [-0.5, -0.5]]))
    assert forwards == pytest.approx([-0.2, 0.1])
    assert backwards == pytest.approx(forwards)


def test_presliding_with_a_tiny_way_is_coulomb_friction() -> None:
    levels = {"fc1": 1.0, "fc2": 0.5}
    apart = []
    coulomb = with_effect("coulomb_friction", BASE, levels)
    task = experiment(coulomb, seconds=0.3)
    expected = simulate_within(coulomb, coulomb.numbers(), task).trajectory
    for way in (1e-3, 1e-4, 1e-5):
        model = with_effect("presliding_friction", BASE, {**levels, "zs1": way, "zs2": way})
        found = simulate_within(model, model.numbers(), task).trajectory
        apart.append(difference(found, expected))
    assert apart[0] > 10.0 * apart[2]
    assert apart[2] < RIGID


def test_coulomb_friction_with_a_way_that_is_neutral_is_coulomb_friction() -> None:
    levels = {"fc1": 1.0, "fc2": 0.5}
    rigid = with_effect("coulomb_friction", BASE, levels).numbers().elements
    way = with_effect("presliding_friction", BASE, {**levels, "zs1": 0.0, "zs2": 1e-3})
    one, two = way.numbers().elements
    assert one.values == rigid[0].values
    assert two.values == (0.5, 1e-3)


def test_bristles_hold_a_joint_like_a_spring_of_level_over_way() -> None:
    """A small pull on a joint with nothing else: it moves by the torque over the slope.

    A little further, because it swings before it rests and the bristles slip on the way.
    """
    free = looped(PAPER, gain=0.0)
    values = {"fc1": 5.0, "fc2": 5.0, "zs1": 1e-3, "zs2": 1e-3, "to1": 0.05, "to2": 0.0}
    kinds = ("presliding_friction", "torque_offset", "viscous_friction")
    model = free.with_effects([effect(k) for k in kinds], {**values, "fv1": 80.0, "fv2": 10.0})
    task = task_from(model, np.zeros(8), np.zeros((2000, 2)))
    settled = run(model, model.numbers(), task, 8).q[-200:, 0].mean()
    assert settled == pytest.approx(0.05 * 1e-3 / 5.0, rel=0.1)


def test_ripple_repeats_with_the_position_and_does_no_work_over_a_period() -> None:
    order, e = 12.0, np.array([0.3, -0.2, 12.0])
    at = np.linspace(0.0, 2.0 * np.pi / order, 200, endpoint=False)
    force = np.array(
        [compile_law(RIPPLE)(np.array([x]), np.zeros(1), np.zeros(0), e)[0] for x in at]
    )
    assert np.hypot(0.3, 0.2) == pytest.approx(np.abs(force).max(), rel=1e-3)
    assert abs(force.sum()) < 1e-12 * len(at)


def test_the_torque_never_exceeds_its_limit() -> None:
    model = with_effect("drive_saturation", BASE, {"ul1": 9.0, "ul2": 5.0})
    torque = simulate_within(model, model.numbers(), experiment(model)).trajectory.torque
    assert np.abs(torque).max(axis=0) == pytest.approx([9.0, 5.0])


def test_a_stated_limit_that_is_smaller_stays() -> None:
    drive = build_drive("velocity_loop", {"gains": [60.0, 30.0], "limits": [4.0, 50.0]})
    model = with_effect("drive_saturation", Model(PAPER, drive), {"ul1": 9.0, "ul2": 5.0})
    assert model.numbers().law.limit.tolist() == [4.0, 5.0]


def _response(law: DriveLaw, s: complex) -> np.ndarray:
    """(nj, nr + n): torque per reference and per coordinate at a complex frequency."""
    inside = np.linalg.inv(s * np.eye(law.states) - law.Fs)
    to_reference = law.R - law.S @ inside @ law.Fr
    to_place = -law.P - s * law.V - law.S @ inside @ (law.Fq + s * law.Fv)
    return np.hstack([to_reference, to_place])


@pytest.mark.parametrize("kind", ["velocity_loop", "cascade", "state_feedback"])
@pytest.mark.parametrize("hertz", [0.3, 5.0, 80.0])
def test_a_lagged_law_is_the_law_behind_a_first_order_low_pass(kind: str, hertz: float) -> None:
    law = build_drive(kind, OPTIONS[kind]).law(PAPER, arm_vector(PAPER), {})
    time, s = 0.007, 2j * np.pi * hertz
    late = lagged(law, time)
    assert late.states == law.states + 2
    assert np.array_equal(late.limit, law.limit)
    expected = _response(law, s) / (1.0 + time * s)
    assert np.allclose(_response(late, s), expected, rtol=1e-10, atol=1e-10)


def test_a_lag_that_vanishes_vanishes() -> None:
    base = looped(PAPER, level="lpv")
    task = experiment(base, seconds=0.3)
    late = [with_effect("drive_lag", base, {"tl": time}) for time in (1e-4, 1e-5)]
    apart = [np.abs(moved(m, task).q - moved(base, task).q).max() for m in late]
    assert apart[0] == pytest.approx(10.0 * apart[1], rel=0.1)


@pytest.mark.parametrize("name", ["1-1", "2-2", "slide"])
def test_the_load_of_a_joint_is_the_inertia_of_the_stretched_rigid_arm(name: str) -> None:
    arm = ARMS[name]
    model = looped(arm)
    q = np.zeros(arm.coordinates)
    M = model.compiled.mass_matrix(q, model.numbers().p)
    for k in range(arm.joints):
        assert joint_load(arm, k) == pytest.approx(M[k, k], rel=1e-9)


def test_the_twist_is_the_compliance_times_the_torque_that_the_arm_needs() -> None:
    sizes = {"c1": 1e-4, "c2": 2e-4, "Jh1": 0.1, "Jh2": 0.05}
    model = with_effect("joint_elasticity", BASE, sizes)
    motion = moved(model, experiment(model, amplitude=0.05))
    speed = np.gradient(motion.v[:, :2], motion.time, axis=0)
    through = motion.torque - np.array([0.1, 0.05]) * speed  # what the rotor does not take
    smooth = slice(5, 20)  # before the first step of the reference
    for k, c in enumerate((1e-4, 2e-4)):
        twist = motion.q[:, model.arm.twist_place(k)]
        assert twist[smooth] == pytest.approx(-c * through[smooth, k], rel=0.05, abs=5e-6)


CONVERGED = 1e-6
"""m or rad: of a motion of millimetres."""


def test_a_joint_that_hardly_gives_way_is_rigid() -> None:
    sizes = {"Jh1": 0.1, "Jh2": 0.05}
    stiff = with_effect("joint_elasticity", BASE, {**sizes, "c1": 1e-9, "c2": 1e-9})
    rigid = with_effect("rotor_inertia", BASE, sizes)
    task = [experiment(m, seconds=0.3) for m in (stiff, rigid)]
    a, b = (
        simulate_fixed(m, m.numbers(), t, 16) for m, t in zip((stiff, rigid), task, strict=True)
    )
    assert np.abs(a.joint_positions - b.joint_positions).max() < CONVERGED


def test_only_the_joints_with_a_size_become_elastic() -> None:
    model = with_effect("joint_elasticity", BASE, {"c1": 0.0, "c2": 1e-4})
    assert model.arm.elastic == (False, True)
    assert np.isfinite(moved(model, experiment(model, seconds=0.1)).q).all()


def test_a_motor_of_an_elastic_joint_keeps_some_inertia_whatever_a_fit_tries() -> None:
    model = with_effect("joint_elasticity", BASE, {"c1": 1e-4, "c2": 1e-4})
    p = model.numbers({"Jh1": 0.0, "Jh2": 0.0, "c1": 0.0}).p
    least = LEAST_LOAD * joint_load(PAPER, 0)
    assert 0.0 < p[slot(0, HUB_INERTIA)] <= least
    assert np.isfinite(p).all()
    for name in ("Jh1", "Jh2"):
        assert model.parameters[name].lower > 0.0


def test_an_elastic_joint_without_a_motor_is_refused_in_words() -> None:
    with pytest.raises(ValueError, match="needs a hub_inertia above zero"):
        Segment(length=0.5, mass=1.0, modes=0, joint_compliance=1e-4)


def test_a_rotor_without_a_gear_is_motor_enough_for_an_elastic_joint() -> None:
    segment = Segment(length=0.5, mass=1.0, modes=0, joint_compliance=1e-4, rotor_inertia=0.1)
    arm = PAPER.model_copy(update={"segments": (PAPER.segments[0], segment)})
    model = looped(arm)
    hub, rotor = model.parameters["Jh2"], model.parameters["Jr2"]
    assert (hub.value, hub.lower, rotor.value) == (0.0, 0.0, 0.1)
    assert hub.upper > 0.0 and np.isfinite(model.numbers({"Jh2": 0.0}).p).all()


GAP = {"bl1": 2e-3, "bl2": 1e-3, "Jh1": 0.1, "Jh2": 0.05}


def test_backlash_lets_the_arm_swing_by_its_gap_and_hardly_more() -> None:
    model = with_effect("backlash", BASE, GAP)
    motion = simulate_within(model, model.numbers(), experiment(model, seconds=1.0)).trajectory
    peak = np.abs(motion.torque).max(axis=0)
    for k, gap in enumerate((2e-3, 1e-3)):
        widest = np.abs(motion.q[:, model.arm.twist_place(k)]).max()
        pressed = peak[k] / model.numbers().p[slot(k, TWIST_STIFFNESS)]
        assert 0.9 * gap < widest < gap + 2.0 * pressed


def test_backlash_converges_in_the_steps() -> None:
    model = with_effect("backlash", BASE, GAP)
    task, numbers = experiment(model), model.numbers()
    fine = run(model, numbers, task, 128)
    errors = [difference(run(model, numbers, task, s), fine) for s in (8, 16, 32)]
    assert errors[2] < CONVERGED
    assert errors[0] > 5.0 * errors[2], "each doubling should gain at least a factor of two"


def test_teeth_give_back_no_more_energy_than_they_took() -> None:
    """A coasting arm with play: kinetic, bending and contact energy together never grow."""
    model = with_effect("backlash", looped(PAPER, gain=0.0), GAP)
    n = model.arm.coordinates
    start = np.zeros(2 * n)
    start[:2], start[n : n + 2] = (0.3, 1.2), (0.5, -0.3)
    motion = simulate_fixed(model, model.numbers(), task_from(model, start, np.zeros((401, 2))), 64)
    total = _energy_with_contact(model, motion)
    assert np.diff(total).max() < 1e-7 * total[0]
    assert total[-1] < total[0]


def test_teeth_are_as_stiff_as_the_elastic_joint_where_there_is_one() -> None:
    both = BASE.with_effects(
        [effect("backlash"), effect("joint_elasticity")], {"c1": 2e-4, "c2": 3e-4, **GAP}
    )
    alone = with_effect("backlash", BASE, GAP)
    places = [slot(k, TWIST_STIFFNESS) for k in range(2)]
    assert both.numbers().p[places] == pytest.approx([5000.0, 1.0 / 3e-4])
    stiff = [CONTACT_RATE**2 * joint_load(PAPER, k) for k in range(2)]
    assert alone.numbers().p[places] == pytest.approx(stiff)
    stiffness = {one.values[0]: one.values[1] for one in both.numbers().elements}
    assert stiffness == pytest.approx({2e-3: 5000.0, 1e-3: 1.0 / 3e-4})


def test_a_constant_torque_creeps_at_its_share_of_the_loops_gain() -> None:
    model = with_effect("torque_offset", BASE, {"to1": 0.6, "to2": 0.0})
    task = experiment(model, seconds=2.0)
    still = replace(task, references=np.zeros_like(task.references))
    motion = run(model, model.numbers(), still, 4)
    assert motion.v[-500:, 0].mean() == pytest.approx(0.6 / 60.0, rel=0.02)


def _energy_with_contact(model: Model, motion) -> np.ndarray:  # type: ignore[no-untyped-def]
    """J: the spring k twist of the structure less what the element takes back, integrated."""
    K = model.compiled.linear_matrices(motion.q[0], motion.p)[0]
    total = np.array([
        0.5 * v @ model.compiled.mass_matrix(q, motion.p) @ v + 0.5 * q @ K @ q
        for q, v in zip(motion.q, motion.v, strict=True)
    ])  # fmt: skip
    for one in model.numbers().elements:
        x = motion.q @ one.rows(model.arm.coordinates)[0]
        grid = np.linspace(min(x.min(), 0.0), max(x.max(), 0.0), 20001)
        law, e = compile_law(one.law), np.array(one.values)
        force = [law(np.array([g]), np.zeros(1), np.zeros(0), e)[0] for g in grid]
        taken_back = cumulative_trapezoid(force, grid, initial=0.0)
        total -= np.interp(x, grid, taken_back) - np.interp(0.0, grid, taken_back)
    return total
