"""The scenario with what was found, by facts; and that it runs again to the same end."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flexgui.core.diagnosed_scenario import diagnosed_scenario, found_texts, identified_scenario
from flexgui.core.loading import load_recordings
from flexgui.core.progress import Silent
from flexgui.core.recording.save import save_recording
from flexgui.core.results import (
    DescriptorModel,
    Diagnosis,
    Estimate,
    Fit,
    Identifiability,
    LadderStep,
    Outcome,
)
from flexgui.core.scenario.read import parse_scenario
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.export.export_files import export_scenario, seen_from
from tests.approved import approved

SAME_ERROR = 0.02
"""Relative: two fits of the same model that began at different places."""

HEAD = """
title = "plain"
[arm]
preset = "paper"
[drive]
kind = "velocity_loop"
gains = [60.0, 30.0]
[sensors]
camera_noise = 3e-5
encoder_noise = 1e-5
[identify]
parameters = ["EI1", "EI2"]
"""
RECORDING = "[[recordings]]\nname = 'a'\nsimulate = {theta2 = 1.0, seconds = 0.4}\n"
FRICTION: tuple[dict[str, Any], ...] = (
    {"id": "coulomb_friction", "fc1": {"start": 1.2, "vary": True}},
)
ORIGINS = {"EI1": "arm", "EI2": "arm", "fc1": "coulomb_friction", "start_theta1": "sensor"}
VALUES = {"EI1": 519.0, "EI2": 522.0, "fc1": 1.21}


def found(**more: Any) -> Diagnosis:
    given = {"effects": FRICTION, "values": VALUES, "origins": ORIGINS, **more}
    return Diagnosis("missing", "nothing_missing", (), (), {}, **given)


def identified(diagnosis: Diagnosis | None) -> Outcome:
    """A run that ended with VALUES."""
    estimates = tuple(Estimate(name, value, 0.1, "", True) for name, value in VALUES.items())
    known = Identifiability(tuple(VALUES), len(VALUES), np.ones(len(VALUES)), np.zeros((0, 3)))
    fit = Fit("all", ("a",), estimates, np.eye(len(VALUES)), 1.0, 10, (), known, 0.0)
    none = np.zeros((0, 0))
    model = DescriptorModel(
        (), np.zeros((0, 0, 0)), (), np.zeros((0, 0, 0)), none, (), none, none, (), ()
    )
    return Outcome(
        "plain", "glocal", "lpv", (fit,), (), model, (), diagnosis=diagnosis, origins=ORIGINS
    )


def scenario(*parts: str) -> Scenario:
    return parse_scenario("\n".join((HEAD, *parts)), "case.toml")


HELD = "[model]\neffects = [{id = 'coulomb_friction', fc1 = {start = 0.4, vary = false}}]"
THERE = "[model]\neffects = [{id = 'coulomb_friction', fc1 = 0.4}]"
OWN = (
    "[[model.own]]\ntarget = 'joint1'\nformula = '-a*tanh(dtheta1/0.001)'\n"
    "parameters = {a = {start = 0.5, unit = 'N m'}}"
)
PRIOR = "prior = {EI1 = 5.0}\nstart = {EI1 = 500.0}"
OTHER = "[[compare]]\ntitle = 'soft'\narm = {modes = 2}"
STARTS = {"values": {**VALUES, "start_theta1@a": 1e-4}}
SHARED = {
    "effects": tuple({"id": kind, "Jh1": {"start": 0.5}}
                     for kind in ("rotor_inertia", "joint_elasticity")),
    "values": {**VALUES, "Jh1": 0.4}, "origins": {**ORIGINS, "Jh1": "joint_elasticity"},
}  # fmt: skip
FORMULA = {"values": {**VALUES, "a": 0.7}, "origins": {**ORIGINS, "a": "own_1"}}
CASES: dict[str, tuple[tuple[str, ...], dict[str, Any]]] = {
    "what was found, at its final values, with the full equations": ((RECORDING,), {}),
    "a diagnosis is still asked for": ((RECORDING, "[diagnose]\nmax_effects = 0"), {}),
    "starts of the only recording": ((RECORDING,), STARTS),
    "starts of several recordings": ((RECORDING, RECORDING.replace("'a'", "'b'")), STARTS),
    "a prior stays about what it was about": ((PRIOR, RECORDING), {}),
    "an effect that was there goes on from its fit": ((RECORDING, THERE), {}),
    "what two effects share is said once": ((RECORDING,), SHARED),
    "what the user holds stays held": ((RECORDING, HELD), {}),
    "a formula goes on from its fit": ((RECORDING, OWN), FORMULA),
    "models that were compared are left out": ((RECORDING, OTHER), {}),
}


def test_the_scenario_with_what_was_found() -> None:
    """Each text reads back as the same scenario."""
    texts = []
    for name, (parts, more) in CASES.items():
        stated, diagnosis = scenario(*parts), found(**more)
        text = found_texts(stated, identified(diagnosis))["diagnosed.toml"]
        assert parse_scenario(text, "diagnosed.toml") == diagnosed_scenario(stated, diagnosis)
        texts.append(f"# {name.upper()}\n\n{text}")
    approved("diagnosed.toml", "\n".join(texts))


def test_the_values_of_what_was_found_are_in_its_model() -> None:
    made = diagnosed_scenario(scenario(RECORDING, THERE), found())
    assert base_model(made).effect_values["fc1"] == 1.21
    made = diagnosed_scenario(scenario(RECORDING), found(**SHARED))
    assert base_model(made).effect_values["Jh1"] == 0.4
    held = THERE.replace("fc1 = 0.4", "fc1 = {start = 0.4}")
    made = identified_scenario(scenario(RECORDING, held), identified(None))
    assert made.identify.start == {"EI1": 519.0, "EI2": 522.0}, "without a diagnosis"
    assert base_model(made).effect_values["fc1"] == 1.21
    assert (made.model.level, made.identify.generations) == ("auto", 0)


def test_values_that_an_added_effect_has_moved_are_not_written() -> None:
    step = LadderStep("coulomb_friction", "Coulomb friction", (), (), None, 1.0)
    grown, stated = replace(found(), steps=(step,)), scenario(RECORDING)
    assert set(found_texts(stated, identified(grown))) == {"diagnosed.toml"}
    assert set(found_texts(stated, identified(found()))) == {"identified.toml", "diagnosed.toml"}


def test_a_file_is_named_from_where_the_text_lies_and_one_elsewhere_whole(tmp_path: Path) -> None:
    data, out = tmp_path / "data", tmp_path / "reports" / "mine"
    assert seen_from(data / "th1.csv", out) == "../../data/th1.csv"
    assert seen_from(Path("/one/th1.csv"), Path("/other/out")) == "/one/th1.csv"


HIDDEN = "hidden = {coulomb_friction = {fc1 = 1.2, fc2 = 0.5}}"
POINTS = (0.8, 1.7)
CANDIDATES = ["coulomb_friction", "viscous_friction", "tip_payload"]


def recorded(folder: Path) -> Path:
    """A scenario and two recordings from files of an arm with a friction that it lacks."""
    folder.mkdir()
    entries = "".join(
        f"[[recordings]]\nname = 'r{k}'\n"
        f"simulate = {{theta2 = {p}, seconds = 0.6, seed = {k + 1}}}\n{HIDDEN}\n"
        for k, p in enumerate(POINTS)
    )
    rig = scenario(entries)
    for recording in load_recordings(rig, base_model(rig), folder, None, Silent()):
        save_recording(recording, folder / f"{recording.name}.csv")
    files = "".join(f"[[recordings]]\nfile = 'r{k}.csv'\n" for k in range(len(POINTS)))
    path = folder / "mine.toml"
    path.write_text(f"{HEAD}[diagnose]\nmax_effects = 2\ncandidates = {CANDIDATES}\n{files}")
    return path


def export(path: Path, out: Path) -> dict[str, Any]:
    export_scenario(path, out, None, Silent(), lambda _: None)
    return dict(json.loads((out / "result.json").read_text("utf-8")))


@pytest.mark.long
def test_exported_again_it_gives_the_same_error_and_nothing_is_missing(tmp_path: Path) -> None:
    first = export(recorded(tmp_path / "data"), tmp_path / "reports" / "first")
    assert (first["verdict"], first["final_verdict"]) == ("missing", "nothing_missing")
    again = export(tmp_path / "reports" / "first" / "diagnosed.toml", tmp_path / "second")
    assert again["verdict"] == "nothing_missing"
    error, before = again["steps"][0]["tip_rms_m"], first["steps"][-1]["tip_rms_m"]
    assert error == pytest.approx(before, rel=SAME_ERROR)
    assert {p["name"]: p["of"] for p in again["parameters"]}["fc1"] == "coulomb_friction"
    # The whole tree may be moved.
    shutil.move(tmp_path / "reports", tmp_path / "elsewhere")
    moved = tmp_path / "elsewhere" / "first" / "diagnosed.toml"
    stated = parse_scenario(moved.read_text("utf-8"), moved.name)
    assert all((moved.parent / str(r.file)).is_file() for r in stated.recordings)
