"""Scenarios of the paper's arm, the fits that diagnoses begin with, and what diagnoses say."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flexgui.core.diagnose.base_fit import BaseFit, fit_base
from flexgui.core.identify.setup import Setup, make_setup
from flexgui.core.loading import load_recordings
from flexgui.core.progress import Silent
from flexgui.core.recording.recording import Recording
from flexgui.core.results import Diagnosis
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model, with_effect_parameters
from flexgui.core.workbench import run_scenario


def on_paper(**tables: Any) -> Scenario:
    """A scenario with these tables: the paper's arm in its loop, full equations, where none says
    otherwise."""
    return Scenario.model_validate({
        "title": "x",
        "arm": {"preset": "paper"},
        "drive": {"kind": "velocity_loop", "gains": [60.0, 30.0]},
        "model": {"level": "nonlinear"},
        **tables,
    })  # fmt: skip


def set_up(scenario: Scenario, folder: Path = Path()) -> tuple[Setup, list[Recording]]:
    """How the scenario's recordings are compared, and the recordings."""
    model = base_model(scenario)
    spec = with_effect_parameters(scenario.identify, model, scenario.model)
    recordings = list(load_recordings(scenario, model, folder, None, Silent()))
    return make_setup(model, spec, recordings), recordings


def fitted(setup: Setup, recordings: list[Recording], scenario: Scenario,
           stated: Mapping[str, float] | None = None) -> BaseFit:  # fmt: skip
    """The model on its recordings, with the noise that is stated by channel."""
    spec = with_effect_parameters(scenario.identify, setup.model, scenario.model)
    parts = setup.model, setup.outputs, setup.processing, spec
    return fit_base(*parts, recordings, stated or {}, 1e-3)


def begun(scenario: Scenario) -> BaseFit:
    """The same with nothing stated."""
    return fitted(*set_up(scenario), scenario)


def diagnosis_of(scenario: Scenario, **run: Any) -> Diagnosis:
    """What a run of the scenario says; `run` as for `run_scenario`."""
    found = run_scenario(scenario, **run).diagnosis
    assert found is not None
    return found
