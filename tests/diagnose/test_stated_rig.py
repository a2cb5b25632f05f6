"""What cannot be by what is stated of the rig is not sought, and it is said why."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from flexgui.core.diagnose.diagnose import diagnose
from flexgui.core.diagnose.fit_problem import FitProblem, undetectable_parameters
from flexgui.core.diagnose.search_options import Options
from flexgui.core.diagnose.search_round import applicable, not_applicable, ruled_out
from flexgui.core.effects import catalogue, effect
from flexgui.core.scenario.rig_spec import RigSpec
from tests.diagnose.test_stated_effects import bare

WORDS = RigSpec.words()
KINDS = sorted(catalogue())


def known(*statements: str) -> FitProblem:
    return replace(bare().data, stated_rig={name: WORDS[name] for name in statements})


def statements_of(kind: str) -> Iterator[str]:
    """By which the effect, or a part of it, cannot be."""
    one, data = effect(kind), bare().data
    yield one.ruled_out_by
    arm = one.changed_arm(data.bare.arm, {})
    yield from (k.ruled_out_by for k in one.parameters(arm, data.bare.drive, data.sizes))


@pytest.mark.parametrize("kind", KINDS)
def test_an_effect_names_statements_that_can_be_made(kind: str) -> None:
    assert set(statements_of(kind)) <= {"", *WORDS}


@pytest.mark.parametrize("statement", WORDS)
def test_each_statement_rules_something_out(statement: str) -> None:
    assert any(statement in statements_of(kind) for kind in KINDS)


@pytest.mark.parametrize("statement", WORDS)
@pytest.mark.parametrize("kind", KINDS)
def test_what_is_ruled_out_is_not_offered_with_the_reason_and_all_else_is(
    kind: str, statement: str
) -> None:
    data, before = known(statement), not_applicable(bare().data, [kind])
    if effect(kind).ruled_out_by == statement:
        assert not_applicable(data, [kind]) == {kind: f"Stated: {WORDS[statement]}."}
        assert ruled_out(data, [kind]) == {effect(kind).title: WORDS[statement]}
        assert applicable(data, [], [kind]) == []
    else:
        assert not_applicable(data, [kind]) == before
        assert effect(kind).title not in ruled_out(data, [kind])


def test_a_scale_is_ruled_out_sensor_by_sensor_and_as_a_whole_where_none_is_left() -> None:
    one, data = effect("sensor_gain"), known("gauges_calibrated")
    rig = replace(data.rig, outputs=("deflection", "encoder"))
    assert set(one.ruled_out(rig, data.sizes)) == {
        "error of the scale of gauge 1", "error of the scale of gauge 2",
    }  # fmt: skip
    alone = replace(rig, outputs=("deflection",))
    assert one.ruled_out(alone, data.sizes) == {one.title: "the strain gauges are calibrated"}


def test_a_rotor_is_where_the_motors_are_stated_to_have_it() -> None:
    rotor = [effect("rotor_inertia")]
    assert set(undetectable_parameters(known("direct_drive"), rotor)) == {"Jh2"}
    assert set(undetectable_parameters(known("gear_ratio"), rotor)) == {"Jr2"}
    assert undetectable_parameters(bare().data, rotor) == {}


def test_a_diagnosis_ranks_nothing_that_was_ruled_out_and_keeps_the_reason() -> None:
    asked = Options(
        max_effects=0, candidates=("gravity_tilt", "torque_offset"),
        stated_rig={"level": WORDS["level"]},
    )  # fmt: skip
    begun: Any = replace(bare(), data=known("level"))
    setup: Any = SimpleNamespace(model=SimpleNamespace(effects=()))
    found = diagnose(setup, SimpleNamespace(), (), asked, base_fit=begun)  # type: ignore[arg-type]
    assert [r.effect for r in found.ranking] == ["torque_offset"]
    assert found.not_applicable == {"gravity_tilt": "Stated: the rig is level."}
    assert found.ruled_out == {"Tilted base plate": "the rig is level"}
