"""Effects whose parameters are about separate things: what is not stated stays neutral."""

from __future__ import annotations

import pytest

from flexgui.core.scenario.rig_spec import EffectSpec, ModelSpec
from flexgui.core.scenario.schema import IdentifySpec
from flexgui.core.scenario.stated_effects import (
    with_effect_parameters,
    with_hidden_effects,
    with_stated_effects,
)
from tests.helpers import PAPER, looped

IDENTIFY = IdentifySpec(parameters=("EI1",))


def estimated(**said: object) -> tuple[str, ...]:
    spec = ModelSpec(effects=(EffectSpec(**said),))
    model = with_stated_effects(looped(PAPER), spec)
    return with_effect_parameters(IDENTIFY, model, spec).parameters


@pytest.mark.parametrize(("kind", "name"), [("sensor_delay", "te2"), ("sensor_gain", "gg1")])
def test_only_the_stated_channel_is_estimated(kind, name):
    assert estimated(id=kind, **{name: {"start": 0.002}}) == ("EI1", name)


@pytest.mark.parametrize(("kind", "letter"), [("sensor_delay", "t"), ("sensor_gain", "g")])
def test_where_none_is_stated_all_channels_are_estimated(kind, letter):
    names = [f"{letter}{own}{k}" for own in "aegluws" for k in (1, 2)]
    assert sorted(estimated(id=kind)) == sorted(["EI1", *names])


def test_a_level_of_friction_that_is_not_stated_is_estimated_as_before():
    assert set(estimated(id="coulomb_friction", fc1={"start": 1.0})) == {"EI1", "fc1", "fc2"}


def test_a_hidden_gauge_scale_leaves_the_other_sensors_right():
    model = with_hidden_effects(looped(PAPER), {"sensor_gain": {"gg1": -0.4}}, "r")
    assert {n: v for n, v in model.effect_values.items() if v} == {"gg1": -0.4}
