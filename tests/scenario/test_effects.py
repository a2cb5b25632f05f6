"""Effects in a scenario: stated, own, hidden; what is estimated; what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.loading import load_recordings
from flexgui.core.model import Model
from flexgui.core.progress import Silent
from flexgui.core.scenario.read import parse_scenario, scenario_toml
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import (
    base_model,
    candidate_effects,
    with_effect_parameters,
)
from flexgui.core.workbench import run_scenario
from tests.helpers import refusal
from tests.slips import sentences_for

HEAD = """
title = "effects"
[arm]
preset = "paper"
[drive]
gains = [60.0, 30.0]
[identify]
parameters = ["EI"]
output = ["z", "encoder"]
generations = 0
"""

RECORDING = """
[[recordings]]
name = "a"
simulate = {theta2 = 1.0, seconds = 0.4}
"""

FRICTION = """
[model]
effects = [{id = "coulomb_friction", fc1 = {start = 1.0, lower = 0.1}, fc2 = 0.5}]
"""


def scenario(*parts: str, head: str = HEAD) -> Scenario:
    return parse_scenario("".join((head, *parts)), "case.toml")


def model(*parts: str) -> Model:
    return base_model(scenario(*parts))


def loaded(*parts: str):  # type: ignore[no-untyped-def]
    stated = scenario(*parts)
    return load_recordings(stated, base_model(stated), None, None, Silent())  # type: ignore[arg-type]


def hidden(what: str, simulate: str = "") -> str:
    table = f"theta2 = 1.0, seconds = 0.4{simulate}"
    return f'\n[[recordings]]\nname = "a"\nsimulate = {{{table}}}\nhidden = {{{what}}}\n'


def test_stated_effects_are_in_the_model_at_their_starts():
    found = model(FRICTION)
    assert [one.kind for one in found.effects] == ["coulomb_friction"]
    assert found.effect_values == {"fc1": 1.0, "fc2": 0.5}
    assert found.level == "nonlinear"


def test_an_effect_without_values_starts_at_plausible_ones():
    found = model('[model]\nlevel = "lpv"\neffects = [{id = "viscous_friction"}]')
    assert found.level == "lpv"
    assert all(value > 0.0 for value in found.effect_values.values())


def test_a_switched_effect_may_be_stated_twice():
    text = '[model]\neffects = [{id = "extra_bending_mode"}, {id = "extra_bending_mode"}]'
    assert model(text).arm.modes == (3, 3)


def test_what_varies_is_estimated_with_its_bounds_and_prior():
    text = """
[model]
effects = [{id = "coulomb_friction", fc1 = {start = 1.0, lower = 0.1, prior = 0.3},
            fc2 = {start = 0.5, vary = false}}, {id = "tip_payload", mt2 = 0.2}]
"""
    stated = scenario(text.replace(",\n", ","))
    found = with_effect_parameters(stated.identify, base_model(stated), stated.model)
    assert found.parameters == ("EI", "fc1", "mt2")
    assert found.bounds["fc1"][0] == 0.1
    assert found.prior["fc1"].std == 0.3
    assert "fc2" not in found.bounds


@pytest.mark.parametrize(
    "text",
    [
        FRICTION,
        '[model]\neffects = [{id = "extra_bending_mode"}, {id = "extra_bending_mode"}]\n',
        '[[model.own]]\ntarget = "joint1"\nformula = "-a*tanh(dtheta1/b)"\n'
        'parameters = {a = {start = 1.0, unit = "N m", lower = 0.0}, b = 0.01}\n',
        '[diagnose]\nmax_effects = 2\ncandidates = ["coulomb_friction", "tip_payload"]\n',
        hidden("coulomb_friction = {fc1 = 1.0}, extra_bending_mode = {}"),
    ],
)
def test_a_scenario_with_effects_is_written_and_read_back_equal(text):
    stated = scenario(text)
    assert parse_scenario(scenario_toml(stated), "again.toml") == stated


def test_a_hidden_effect_changes_the_recording_and_not_the_model():
    plain, changed = loaded(RECORDING)[0], loaded(hidden("coulomb_friction = {fc1 = 3.0}"))[0]
    assert np.abs(plain["theta1"] - changed["theta1"]).max() > 1e-4
    assert model(hidden("coulomb_friction = {fc1 = 3.0}")).effects == ()


def test_what_the_model_is_given_does_not_change_the_data():
    before, after = loaded(RECORDING)[0], loaded(RECORDING, FRICTION)[0]
    for channel in ("theta1", "z1", "u2"):
        assert np.array_equal(before[channel], after[channel])


def test_the_stated_effect_finds_the_size_of_the_hidden_one():
    noise = "\n[sensors]\ncamera_noise = 1e-5\nencoder_noise = 1e-5\n"
    truth = hidden("coulomb_friction = {fc1 = 2.0, fc2 = 0.8}", ", seed = 3")
    # A joint that sticks stays where the noise of its first sample has put it.
    starts = HEAD.replace("generations = 0", "generations = 0\ninitial_state = true")
    found = run_scenario(scenario(FRICTION, truth, noise, head=starts))
    estimates = {e.name: e for e in found.fits[0].estimates}
    assert set(estimates) >= {"EI", "fc1", "fc2"}
    for name, true in (("fc1", 2.0), ("fc2", 0.8)):
        e = estimates[name]
        assert abs(e.value - true) < 4.0 * e.std
        assert e.std < 0.1 * true


def test_a_variant_keeps_the_effects_that_its_arm_can_have():
    damping = FRICTION.replace(
        "effects = [", 'effects = [{id = "structural_damping", tau1 = 1e-3}, '
    )
    variants = "".join(
        f'\n[[compare]]\ntitle = "{modes}"\narm = {{modes = {modes}, EI = 500.0}}\n'
        f"parameters = {names}\n"
        for modes, names in ((0, '["fc1"]'), (2, '["fc1", "tau1"]'))
    )
    found = run_scenario(scenario(damping, RECORDING, variants))
    shared = [[e.name for e in v.estimates if e.recording is None] for v in found.variants]
    assert shared == [["fc1"], ["fc1", "tau1"]]


def test_a_diagnosis_may_try_all_effects_or_those_that_are_named():
    assert len(candidate_effects(scenario().diagnose)) > 20
    named = scenario('[diagnose]\ncandidates = ["tip_payload"]\n').diagnose
    assert [one.kind for one in candidate_effects(named)] == ["tip_payload"]


def said(*parts: str) -> str:
    """Where the scenario is wrong."""

    def used() -> None:
        stated = scenario(*parts)
        found = base_model(stated)
        candidate_effects(stated.diagnose)
        if stated.recordings:
            load_recordings(stated, found, None, None, Silent())  # type: ignore[arg-type]

    return refusal(used)


def test_a_linear_simulation_has_a_linear_effect():
    text = hidden("viscous_friction = {fv1 = 5.0}", ', level = "lpv"')
    plain = hidden("viscous_friction = {fv1 = 0.0, fv2 = 0.0}", ', level = "lpv"')
    assert np.abs(loaded(text)[0]["z1"] - loaded(plain)[0]["z1"]).max() > 1e-5


def test_what_is_wrong_with_effects_is_told():
    sentences_for("wrong_effects.txt", said)
