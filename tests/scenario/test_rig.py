"""What is known of a rig beforehand, as a scenario states it."""

from __future__ import annotations

import pytest

from flexgui.core.errors import InputError
from flexgui.core.scenario.read import parse_scenario, scenario_toml
from flexgui.core.scenario.rig_spec import RigSpec
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model

HEAD = 'title = "rig"\n[arm]\npreset = "paper"\n[drive]\ngains = [60.0, 30.0]\n'
TILT = '[model]\neffects = [{id = "gravity_tilt"}]\n'


def scenario(*lines: str, also: str = "") -> Scenario:
    return parse_scenario("\n".join((HEAD + also, "[rig]", *lines)), "case.toml")


@pytest.mark.parametrize(
    "line", [*(f"{name} = true" for name in RigSpec.words() if name != "gear_ratio"),
             "gear_ratio = [50.0, 100.0]", "gear_ratio = 80"],
)  # fmt: skip
def test_each_statement_is_read_back_as_it_was_written(line: str) -> None:
    stated = scenario(line)
    assert len(stated.rig.statements) == 1
    assert parse_scenario(scenario_toml(stated), "again.toml") == stated


def test_nothing_is_stated_where_nothing_is_said() -> None:
    assert scenario().rig.statements == {} == scenario("level = false").rig.statements


def test_ratios_of_one_are_a_direct_drive_and_mixed_ones_say_nothing_of_all_joints() -> None:
    assert set(scenario("gear_ratio = 1").rig.statements) == {"direct_drive"}
    assert scenario("gear_ratio = [1, 50]").rig.statements == {}


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("levle = true", "level"),
        ('level = "yes"', "level"),
        ("gear_ratio = [0.0, 1.0]", "gear_ratio"),
        ("direct_drive = true\ngear_ratio = 50", "direct_drive"),
    ],
)
def test_what_is_no_statement_is_refused_by_name(line: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        scenario(line)


def test_an_effect_in_the_model_that_cannot_be_is_refused() -> None:
    with pytest.raises(InputError, match="gravity_tilt.*the rig is level"):
        base_model(scenario("level = true", also=TILT))
    assert base_model(scenario("rigid_base = true", also=TILT)).effects


def test_ratios_are_one_for_all_joints_or_one_each() -> None:
    with pytest.raises(InputError, match="3 numbers for 2 joints"):
        base_model(scenario("gear_ratio = [1, 2, 3]"))
