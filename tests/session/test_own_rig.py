"""Arm and drive chosen on the page: what follows can be run, and real files are guessed right."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from flexgui.core.progress import Silent
from flexgui.core.recording.read_table import read_table
from flexgui.core.recording.spec import RecordingSpec
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.library.shipped import demo_scenario
from flexgui.session.scenario_edits import set_value, with_lists
from flexgui.stages.data.inspect import CONTRADICT, inspect_file
from flexgui.stages.data.rigs import (
    RIGS,
    arm_choices,
    arm_edit,
    has_working_points,
    rig_edit,
    rig_of,
)
from flexgui.stages.data.waiting_file import (
    WaitingFile,
    columns_of_rigs,
    waiting_again,
    waiting_for,
    wanted_channels,
)

DATA = Path(os.environ.get("FLEXGUI_DATA", ""))
needs_data = pytest.mark.skipif(
    not (DATA / "emps.csv").is_file(), reason="the real recordings are not here: FLEXGUI_DATA"
)


def chosen(arm: str, rig: str) -> Scenario:
    """The demonstration with another arm, then another rig."""
    found = demo_scenario()
    one = next(r for r in RIGS if r.title == rig)
    for make in (lambda s: arm_edit(s, arm), lambda s: rig_edit(s, one)):
        document = with_lists(found.model_dump(exclude_defaults=True))
        make(found)(document)
        found = Scenario.model_validate(document)
    return found


@pytest.mark.parametrize("rig", [r.title for r in RIGS])
@pytest.mark.parametrize("arm", arm_choices().values())
def test_every_rig_with_every_arm_is_a_scenario(arm: str, rig: str) -> None:
    found = chosen(arm, rig)
    model = base_model(found)
    assert set(found.identify.parameters) <= set(model.parameters)
    one = rig_of(found)
    assert one is not None and one.kind == next(r.kind for r in RIGS if r.title == rig)
    slide = rig.startswith("Slide")
    assert (found.arm.preset == "single_axis") == slide or arm == "single_axis"


def first_look(scenario: Scenario, file: str) -> WaitingFile:
    model = base_model(scenario)
    references = tuple(model.drive.needed_channels(model.arm))
    wanted = wanted_channels(model.arm, references)
    found = inspect_file(str(DATA), file, scenario, wanted, progress=Silent())
    headings = tuple(read_table(DATA / file).columns)
    spec = RecordingSpec(file=file)
    return waiting_again(headings, model.arm, references, spec).guessed(found)


@pytest.mark.parametrize(
    ("arm", "rig", "offered"),
    [
        ("paper", "Velocity loops", True),
        ("paper", "Position loops", True),
        ("paper", "Torque recorded", False),
        ("paper", "Held by its own servo", False),
        ("single_axis", "Slide, force recorded", False),
    ],
)
def test_experiments_at_working_points_are_offered_only_where_a_second_joint_follows_references(
    arm: str, rig: str, offered: bool
) -> None:
    assert has_working_points(chosen(arm, rig)) == offered


@needs_data
def test_nothing_is_asked_about_the_recorded_slide() -> None:
    waiting = first_look(chosen("single_axis", "Slide, force recorded"), "emps.csv")
    assert not waiting.questions and not waiting.inspection.findings
    assert {c: e["name"] for c, e in waiting.columns.items()} == {"theta1": "q", "u1": "force"}


SUITED = {
    "emps.csv": "Slide, force recorded",
    "quanser_2dsfl_steps.csv": "Current recorded",
    "rigs/kukaA.csv": "",  # a torque of one joint that turns: no slide
}


@needs_data
@pytest.mark.parametrize("file", SUITED)
def test_columns_say_of_which_kind_of_rig_they_are(file: str) -> None:
    scenario, path = demo_scenario(), DATA / file
    rigs = columns_of_rigs(scenario)
    found = inspect_file(
        str(path.parent), path.name, scenario, rigs[0].wanted, rigs=rigs, progress=Silent()
    )
    assert found.rig == SUITED[file]
    waiting = waiting_for(path.name, found.headers, base_model(scenario).arm, rigs[0].needed)
    assert waiting is not None and waiting.guessed(found).suits == found.rig


@needs_data
@pytest.mark.parametrize("file", ["quanser_2dsfl_steps.csv", "ctu_2dsfl_lqr.csv"])
def test_nothing_contradicts_the_bench_once_its_arm_is_chosen(file: str) -> None:
    scenario = chosen("two_stage_bench", "Current recorded")
    document = with_lists(scenario.model_dump(exclude_defaults=True))
    set_value(("drive", "torque_constants"), [8.925, 0.87])(document)
    waiting = first_look(Scenario.model_validate(document), file)
    assert not waiting.questions
    assert not {fault for fault, _ in waiting.inspection.findings.values()} & set(CONTRADICT)
