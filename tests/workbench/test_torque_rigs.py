"""A rig whose torques are recorded, as a newcomer states it: arm, drive, files, parameters."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexgui.core.identify.setup import make_setup, torque_band
from flexgui.core.loading import load_recordings
from flexgui.core.progress import Silent
from flexgui.core.recording.recording import Recording
from flexgui.core.scenario.read import read_scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.core.workbench import run_scenario
from tests.sample.torque_rigs import TorqueRig, written

RIG = TorqueRig((3.0,), (0.6,), viscous=(0.8,), rate=500.0, seconds=2.0, bits=17)
MASSES, FRICTION = 0.03, 0.05
"""Relative: what such recordings show in two short runs."""


def test_the_friction_of_a_rigid_link_is_named_though_no_filter_is_stated(tmp_path: Path) -> None:
    """Second differences of an encoder are its noise, which was taken for an elastic joint."""
    found = run_scenario(read_scenario(written(RIG, 5, tmp_path)), folder=tmp_path)
    assert any("Torques are compared up to" in note for note in found.notes)
    told = found.diagnosis
    assert told is not None and told.final_verdict == "nothing_missing"
    assert [s.added for s in told.steps if s.added] == ["viscous_friction"]
    values = {p.name: p.value for p in told.parameters}
    assert values["m1"] == pytest.approx(RIG.masses[0], rel=MASSES)
    assert values["fv1"] == pytest.approx(RIG.viscous[0], rel=FRICTION)


@pytest.mark.parametrize(
    "stated, filtered", [("filter = false", False), ("filter = { cutoff_hz = 30.0 }", True)]
)
def test_a_stated_filter_takes_the_place_of_the_band(
    tmp_path: Path, stated: str, filtered: bool
) -> None:
    path = written(RIG, 5, tmp_path)
    path.write_text(path.read_text().replace("[identify]\n", f"[identify]\n{stated}\n"))
    scenario = read_scenario(path)
    model = base_model(scenario)
    recordings = load_recordings(scenario, model, tmp_path, None, Silent())
    setup = make_setup(model, scenario.identify, recordings)
    assert setup.processing.torque_filter is None
    assert (setup.processing.filter is not None) == filtered
    assert not any("Torques are compared up to" in note for note in setup.notes)


def test_a_recording_that_cannot_hold_the_band_needs_no_low_pass() -> None:
    """Its user stated no cut-off, and is not told that one is too high."""
    rng = np.random.default_rng(2)

    def recording(dt: float, samples: int) -> Recording:
        time = dt * np.arange(samples)
        place = 0.1 * np.sin(2.0 * np.pi * 3.0 * time) + 0.01 * np.sin(2.0 * np.pi * 40.0 * time)
        return Recording("r", time, {"theta1": place + 1e-5 * rng.standard_normal(samples)})

    low_pass, said = torque_band(1, [recording(1e-3, 4000)])
    assert low_pass is not None and 40.0 <= low_pass.cutoff_hz < 60.0 and "Hz" in said
    assert torque_band(1, [recording(1e-3, 4000), recording(0.02, 200)]) == (None, "")
    assert torque_band(1, [recording(1e-3, 4000), recording(1e-3, 20)]) == (None, "")
