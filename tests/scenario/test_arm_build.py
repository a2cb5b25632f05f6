import json

import pytest

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.build import ArmSpec, build_arm
from flexgui.core.arm.presets import presets
from tests.helpers import refusal
from tests.slips import sentences_for

EI_OF_THE_PAPER = 520.83
EI_DIGITS = 1e-5
"""Relative; the paper's value follows from its d and epsilon, printed here to five digits."""


@pytest.mark.parametrize("name", sorted(presets()))
def test_every_preset_is_an_arm_of_its_own_name(name):
    arm = build_arm(ArmSpec(preset=name))
    assert isinstance(arm, Arm)
    assert arm.name == name


def test_the_papers_arm_has_the_papers_stiffness():
    for segment in presets()["paper"].segments:
        assert segment.bending_stiffness == pytest.approx(EI_OF_THE_PAPER, rel=EI_DIGITS)


def test_single_axis_is_one_rigid_slide():
    (segment,) = presets()["single_axis"].segments
    assert (segment.joint, segment.modes, segment.hub_inertia) == ("prismatic", 0, 0.0)


def test_one_value_changes_every_segment_and_a_list_each_its_own():
    arm = build_arm(ArmSpec(preset="paper", modes=2, tip_mass=[0, 0.5], gravity=(0.0, -9.81)))
    assert arm.modes == (2, 2)
    assert [s.tip_mass for s in arm.segments] == [0.0, 0.5]
    assert arm.gravity == (0.0, -9.81)
    assert [s.mass for s in arm.segments] == [7.5, 5.0]


def test_stiffness_replaces_the_section_and_the_section_the_stiffness():
    stiff = build_arm(ArmSpec(preset="paper", EI=[500.0, 600.0]))
    assert [s.bending_stiffness for s in stiff.segments] == [500.0, 600.0]
    assert not any(s.has_section for s in stiff.segments)
    square = build_arm(ArmSpec(width=0.05, young_modulus=1e9), base=stiff)
    assert square.segments == presets()["paper"].segments


def test_segments_alone_make_an_arm_and_on_a_preset_change_it():
    table = {"length": 1.0, "mass": 2.0, "EI": 3.0}
    assert build_arm(ArmSpec(segments=(table,))).segments[0].EI == 3.0
    changed = build_arm(ArmSpec(preset="paper", segments=({}, {"mass": 6.0})))
    assert [s.mass for s in changed.segments] == [7.5, 6.0]


def test_a_base_is_changed_and_a_preset_of_its_own_replaces_it():
    base = build_arm(ArmSpec(preset="paper", modes=3))
    assert build_arm(ArmSpec(modes=0), base).modes == (0, 0)
    assert build_arm(ArmSpec(preset="paper"), base).modes == (1, 1)


def test_a_bad_arm_is_told_in_one_line():
    sentences_for(
        "wrong_arms.txt",
        lambda entry: refusal(lambda: build_arm(ArmSpec.model_validate(json.loads(entry)))),
    )
