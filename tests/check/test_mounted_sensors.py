"""Sensors on links are compared with the arm as joints and cameras are."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flexgui.core.check.run_checks import check_scenario
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.save import save_recording
from flexgui.core.scenario.schema import Scenario
from tests.workbench.test_rigs_as_they_are import simulated

MOUNTS = {"strain1": {"place": 0.01, "distance": 1.5e-3}, "gyro1": {"place": 0.42}}
LINK = {"length": 0.42, "mass": 0.065, "modes": 2, "hub_inertia": 2e-3, "damping_time": 0.01}
MOVED = {"seconds": 5.0, "amplitude": 2.0, "hold": 0.4, "seed": 3}


def rig(recording: dict[str, Any]) -> Scenario:
    return Scenario.model_validate({
        "title": "x",
        "arm": {"segments": [{**LINK, "EI": 0.15}]},
        "drive": {
            "kind": "voltage", "torque_constants": [7.68e-3], "resistances": [2.6], "gears": [70.0]
        },
        "model": {"level": "nonlinear"},
        "sensors": {"encoder_noise": 1e-5, **MOUNTS},
        "identify": {"parameters": ["EI1"], "generations": 0},
        "recordings": [{"name": "rig", **recording}],
    })  # fmt: skip


@pytest.fixture(scope="module")
def recorded() -> Recording:
    return simulated(rig({"simulate": MOVED}))


def faults(recording: Recording, folder: Path, **columns: Any) -> list[tuple[str, str]]:
    """(what, channel) of a file with the rig's channels, where `columns` state more of some."""
    kept = {n: recording[n] for n in ("voltage1", "theta1", "strain1", "gyro1")}
    save_recording(replace(recording, channels=kept), folder / "rig.csv")
    scenario = rig({"file": "rig.csv", **({"columns": columns} if columns else {})})
    return [(f.fault, f.channel) for f in check_scenario(scenario, folder) if f.is_fault]


def with_column(recording: Recording, name: str, factor: float) -> Recording:
    return replace(recording, channels={**recording.channels, name: factor * recording[name]})


def test_good_recordings_have_no_fault(recorded: Recording, tmp_path: Path) -> None:
    assert faults(recorded, tmp_path) == []


def test_a_gauge_on_the_other_side_is_named(recorded: Recording, tmp_path: Path) -> None:
    assert faults(with_column(recorded, "strain1", -1.0), tmp_path) == [("sign", "strain1")]


def test_a_gyroscope_in_degrees_is_named(recorded: Recording, tmp_path: Path) -> None:
    spoilt = with_column(recorded, "gyro1", 180.0 / np.pi)
    assert faults(spoilt, tmp_path) == [("degrees", "gyro1")]


@pytest.mark.parametrize("factor", [-1.0, 3.7e4])
def test_of_a_gauge_with_an_unknown_gain_neither_sign_nor_unit_is_a_fault(
    recorded: Recording, tmp_path: Path, factor: float
) -> None:
    spoilt = with_column(recorded, "strain1", factor)
    assert faults(spoilt, tmp_path, strain1={"name": "strain1", "gain": "unknown"}) == []
