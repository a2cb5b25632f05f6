"""A proposed law is an own effect of a scenario, written and read again."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from flexgui.core.effects.own import OwnEffect
from flexgui.core.results import Estimate
from flexgui.core.results.proposal import ProposedLaw
from flexgui.core.scenario.read import parse_scenario, scenario_toml
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model, with_effect_parameters
from flexgui.session.scenario_edits import apply_edits
from flexgui.stages.diagnose.effects import present, with_law, with_own
from tests.diagnose.fits import on_paper
from tests.sentences.proposals import BEGINS, SIZES, STIFFNESS, law

HYSTERESIS = law(
    title="Hysteresis",
    target="joint1",
    formula="a2*hysteresis(theta1, way)",
    parameters=(
        Estimate("a2", np.float64(-3.5), 0.1, "N m", True, lower=-3500.0, upper=3500.0),
        Estimate("way", np.float64(0.02), 0.001, "rad", True, lower=0.001, upper=0.6),
    ),
)
READING = law(
    title="Lens", target="z1", formula="b*z1**2",
    parameters=(Estimate("b", 0.02, 1e-6, "m/(m)^2", True),),
)  # fmt: skip


def with_laws(*laws: ProposedLaw, base: Scenario | None = None) -> Scenario:
    return apply_edits(base or on_paper(), *(with_law(each) for each in laws))


def read_again(scenario: Scenario) -> Scenario:
    return parse_scenario(scenario_toml(scenario), "case.toml")


@pytest.mark.parametrize("one", [law(), HYSTERESIS, READING], ids=lambda one: one.target)
def test_a_law_in_a_scenario_is_the_effect_that_was_proposed(one: ProposedLaw) -> None:
    (stated,) = read_again(with_laws(one)).model.own
    assert (stated.target, stated.formula, stated.title) == (one.target, one.formula, one.title)
    for estimate in one.parameters:
        own = stated.parameters[estimate.name]
        assert own.start == pytest.approx(estimate.value, rel=1e-12)
        assert own.unit == estimate.unit


def test_its_model_begins_where_the_law_ended() -> None:
    one = law()
    before = one.settings
    scenario = with_laws(one)
    assert one.settings == before and "id" not in before
    model = base_model(scenario)
    spec = with_effect_parameters(scenario.identify, model, scenario.model)
    assert {"a", "c"} <= set(spec.parameters)
    assert model.effect_values == {"a": STIFFNESS, "c": BEGINS}
    (own,) = model.effects
    assert isinstance(own, OwnEffect) and own.target == "joint2"
    assert {q.parameter.name: (q.parameter.lower, q.parameter.upper) for q in own.own_parameters} \
        == {e.name: (e.lower, e.upper) for e in SIZES}  # fmt: skip


def test_a_bound_that_there_is_none_of_is_left_out() -> None:
    entry: Any = READING.settings
    assert entry["parameters"] == {"b": {"start": 0.02, "unit": "m/(m)^2"}}
    half = replace(READING, parameters=(replace(READING.parameters[0], lower=0.0),))
    entry = half.settings
    assert entry["parameters"]["b"]["lower"] == 0.0 and "upper" not in entry["parameters"]["b"]


def test_laws_are_numbered_in_the_order_of_adding() -> None:
    scenario = with_laws(law(), HYSTERESIS, READING)
    assert [own.id for own in scenario.model.own] == ["own_1", "own_2", "own_3"]
    assert [kind for kind, _ in present(read_again(scenario))] == ["own_1", "own_2", "own_3"]
    assert present(scenario)[1] == ("own_2", "Hysteresis")
    assert set(base_model(scenario).effect_values) == {"a", "c", "a2", "way", "b"}


def test_a_law_goes_beside_what_a_person_wrote() -> None:
    given = on_paper(model={
        "level": "nonlinear",
        "own": [{"id": "own_4", "target": "joint1", "formula": "-k*theta1",
                 "parameters": {"k": 1.0}}],
        "effects": [{"id": "viscous_friction"}],
    })  # fmt: skip
    scenario = apply_edits(given, with_law(law()), with_own("joint1", "-q*dtheta1", "q = 2"))
    assert [own.id for own in scenario.model.own] == ["own_4", "own_5", "own_6"]
    assert scenario.model.effects == given.model.effects
    assert scenario.model.own[0] == given.model.own[0]
