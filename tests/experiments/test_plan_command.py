"""`flexgui plan`: files to play, and a scenario that reads their recordings back."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from flexgui.core.experiments.design_files import Names
from flexgui.core.loading import load_recordings
from flexgui.core.progress import Silent
from flexgui.core.recording.load import load_recording
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.save import save_recording
from flexgui.core.recording.spec import RecordingSpec
from flexgui.core.scenario.read import read_scenario, scenario_toml
from flexgui.core.scenario.stated_effects import base_model
from tests.cli.helpers import said
from tests.experiments.rig import planned, recorded, scenario

REFERENCES = ("dtheta1_ref", "dtheta2_ref")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the command leaves."""
    room = tmp_path_factory.mktemp("plan")
    (room / "rig.toml").write_text(scenario_toml(scenario()), encoding="utf-8")
    result = said("plan", str(room / "rig.toml"), "--out", str(room / "next"), "--seconds", "3")
    assert result.exit_code == 0, result.output
    assert "Save what is recorded beside them as recorded1.csv" in result.output
    return room / "next"


def test_references_and_what_to_expect_are_tables_and_the_plan_is_data(folder: Path) -> None:
    play = load_recording(folder / "play1.csv", RecordingSpec(file="play1.csv"), REFERENCES)
    chosen = planned().chosen[0].trial
    assert np.abs(play["dtheta1_ref"]).max() == pytest.approx(chosen.amplitudes[0])
    expected = load_recording(folder / "expected1.csv", RecordingSpec(file="expected1.csv"))
    assert {"theta1", "theta2", "z1", "z2", "u1", "u2"} <= set(expected.channels)
    plan = json.loads((folder / "plan.json").read_text(encoding="utf-8"))
    assert [e["play"] for e in plan["experiments"]] == ["play1.csv", "play2.csv", "play3.csv"]
    assert {d["name"] for d in plan["deviations"]} == {"EI1", "EI2"}
    assert (folder / "plan.txt").read_text(encoding="utf-8").startswith("Record 3 experiments")


def test_what_was_recorded_is_read_back_as_the_same_experiment(folder: Path) -> None:
    for n, c in enumerate(planned().chosen, start=1):
        save_recording(_with_lead_in(recorded(c)), folder / Names(n).recorded)
    asked = read_scenario(folder / "planned.toml")
    model = base_model(asked)
    *_, last = load_recordings(asked, model, folder, None, Silent())
    play = load_recording(folder / "play3.csv", RecordingSpec(file="play3.csv"), REFERENCES)
    assert last.name == "planned 3"
    assert np.allclose(last["dtheta1_ref"], play["dtheta1_ref"])


def _with_lead_in(r: Recording) -> Recording:
    """A logger that was started half a second early."""
    early = int(0.5 / r.sample_time)
    channels = {
        n: np.concatenate([np.full(early, 0.0 if n.endswith("_ref") else x[0]), x])
        for n, x in r.channels.items()
    }
    return Recording(r.name, r.sample_time * np.arange(early + len(r.time)), channels)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--seconds", "0"), "--seconds must be above 0"),
        (("--seconds", "nan"), "--seconds must be above 0"),
        (("--between", "tip_payload"), "--between takes two ids"),
        (("--between", "tip_payload,nothing"), "nothing"),
        (("--for", "EI7"), "EI7"),
    ],
)
def test_a_wrong_option_is_one_sentence(
    tmp_path: Path, arguments: tuple[str, ...], sentence: str
) -> None:
    (tmp_path / "rig.toml").write_text(scenario_toml(scenario()), encoding="utf-8")
    result = said("plan", str(tmp_path / "rig.toml"), "--out", str(tmp_path / "o"), *arguments)
    assert result.exit_code == 2 and sentence in result.output
    assert not (tmp_path / "o").exists()


def test_an_export_and_the_scenario_in_the_same_folder_stay_as_they_are(tmp_path: Path) -> None:
    kept = {"scenario.toml": scenario_toml(scenario()), "report.html": "x"}
    kept["result.json"] = json.dumps({"files": ["report.html", "scenario.toml", "result.json"]})
    for name, text in kept.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    arguments = (str(tmp_path / "scenario.toml"), "--out", str(tmp_path), "--seconds", "1")
    assert said("plan", *arguments).exit_code == 0
    assert (tmp_path / "planned.toml").is_file()
    for name, text in kept.items():
        assert (tmp_path / name).read_text(encoding="utf-8") == text
