"""The model that a scenario states, before any fit."""

from __future__ import annotations

from core.arm.arm import Arm
from core.arm.build import build_arm
from core.drives import build_drive
from core.model import LEVELS, Model
from core.scenario.schema import Scenario
from core.scenario.stated_effects import with_stated_effects


def base_model(scenario: Scenario) -> Model:
    """With the effects that the scenario states."""
    return with_stated_effects(bare_model(scenario, build_arm(scenario.arm)), scenario.model)


def bare_model(scenario: Scenario, arm: Arm) -> Model:
    """Without them, on any arm; a level that is left open is that of the full equations."""
    drive = build_drive(scenario.drive.kind, scenario.drive.options)
    level = scenario.model.level
    return Model(arm, drive, level if level in LEVELS else "nonlinear")
