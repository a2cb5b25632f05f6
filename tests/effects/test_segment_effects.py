"""What effects of segments, tip and base do to an arm."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.arm.chord import deflection_rows
from flexgui.core.effects import effect, with_included
from flexgui.core.effects.effect import Rig
from flexgui.core.forces.compiled import compile_law
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.simulate.experiment import make_task
from flexgui.core.simulate.nonlinear import simulate_within
from tests.helpers import PAPER, looped, with_modes

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
    segments = (
        PAPER.segments[0],
        PAPER.segments[1].model_copy(update={"tip_mass": 0.7}),
    )
    other = looped(PAPER.model_copy(update={"segments": segments}))
    assert np.array_equal(model.numbers().p, other.numbers().p)
