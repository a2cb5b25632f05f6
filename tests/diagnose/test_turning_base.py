"""A base that turns is told apart from an elastic joint, and from what it brings with it."""

from __future__ import annotations

import pytest

from flexgui.core.results.diagnosis import Diagnosis
from flexgui.core.scenario.read import parse_scenario
from flexgui.core.workbench import run_scenario

SCENARIO = """
title = "One link on a turning base"

[[arm.segments]]
length = 0.8
mass = 3.0
EI = 300.0
modes = 1
hub_inertia = 0.05

[drive]
kind = "velocity_loop"
gains = [30.0]

[sensors]
camera_noise = 3e-5
encoder_noise = 1e-4
deflection_noise = 1e-5

[identify]
parameters = ["EI1"]
output = ["encoder", "z"]

[diagnose]
max_effects = 2
"""
RECORDING = """
[[recordings]]
role = "{role}"

[recordings.simulate]
seconds = 2.0
seed = {seed}
hidden = {{ base_rotation = {{ cp = 2e-5, Jp = {Jp} }} }}
"""
COLUMN, LIGHT = 0.3, 0.002
"""kg m²: of a column, and of nearly nothing."""


def diagnosis(Jp: float) -> Diagnosis:
    """Of two recordings and one that validates."""
    roles = ("estimate", "estimate", "validate")
    recordings = [RECORDING.format(role=r, seed=k + 1, Jp=Jp) for k, r in enumerate(roles)]
    found = run_scenario(parse_scenario(SCENARIO + "".join(recordings), "base.toml")).diagnosis
    assert found is not None
    return found


def test_a_column_that_turns_is_no_elastic_joint() -> None:
    found = diagnosis(COLUMN)
    assert found.kept == ("base_rotation",)
    values = {e.name: e.value for e in found.parameters}
    assert values["cp"] == pytest.approx(2e-5, rel=0.01)
    assert values["Jp"] == pytest.approx(COLUMN, rel=0.01)
    shares = {r.effect: r.refit_drop_percent for r in found.rounds[0].ranking}
    assert shares["base_rotation"] == pytest.approx(100.0, abs=0.5)
    assert (shares["joint_elasticity"] or 0.0) < 80.0


@pytest.mark.long
def test_a_base_without_inertia_acts_as_an_elastic_joint() -> None:
    """Nothing needless stays: the first fit of the base ended beside the minimum, and a limit of
    the drive that came in only led there."""
    found = diagnosis(LIGHT)
    assert found.kept == ("base_rotation",)
    shares = {r.effect: r.refit_drop_percent for r in found.rounds[0].ranking}
    assert (shares["joint_elasticity"] or 0.0) > 99.0
