"""A rig whose torques are recorded, as a newcomer states it: arm, drive, files, parameters."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexgui.core.arm.arm import Arm
from flexgui.core.arm.segment import Segment
from flexgui.core.drives.torque import Torque
from flexgui.core.identify.setup import make_setup, torque_band
from flexgui.core.loading import load_recordings
from flexgui.core.model import Model
from flexgui.core.progress import Silent
from flexgui.core.recording.recording import Recording
from flexgui.core.results import ChannelComparison, Outcome
from flexgui.core.scenario.read import read_scenario
from flexgui.core.scenario.schema import IdentifySpec
from flexgui.core.scenario.stated_effects import base_model
from flexgui.core.workbench import run_scenario
from tests.helpers import rms
from tests.programs.sample.torque_rigs import TorqueRig, written

RIG = TorqueRig((3.0,), (0.6,), viscous=(0.8,), rate=500.0, seconds=2.0, bits=17)
MASSES, FRICTION = 0.03, 0.05
"""Relative: what such recordings show in two short runs."""


@pytest.mark.long
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


@pytest.mark.parametrize("slower", [1, 4])
def test_a_camera_is_compared_where_the_encoders_show_how_the_joints_move(slower: int) -> None:
    """Beyond, links vibrate as nobody recorded; a camera that is slower is compared as it is."""
    rng, dt, samples = np.random.default_rng(3), 1e-3, 4000
    time = dt * np.arange(samples)
    place = 0.1 * np.sin(2.0 * np.pi * 3.0 * time) + 1e-5 * rng.standard_normal(samples)
    tip = np.where(np.arange(samples) % slower, np.nan, place)
    channels = {"u1": place, "theta1": place, "z1": 0.6 * np.cos(tip), "z2": 0.6 * np.sin(tip)}
    model = Model(Arm(segments=(Segment(length=0.6, mass=3.0, EI=50.0, modes=1),)), Torque())
    setup = make_setup(model, IdentifySpec(), [Recording("r", time, channels)])
    own, others = setup.processing.filters("torque"), setup.processing.filters("z")
    assert len(own) == 1 and 3.0 < own[0].cutoff_hz < 100.0
    assert [f.cutoff_hz for f in others] == ([2.0 * own[0].cutoff_hz] if slower == 1 else [])
    assert any("All other outputs" in note for note in setup.notes) == (slower == 1)


FAST_LINK = TorqueRig((3.0,), (0.6,), rate=2000.0, bits=16, seconds=2.0, recordings=1)
SLOW_PAIR = TorqueRig(
    (4.0, 2.5), (0.5, 0.4), rate=200.0, bits=18, seconds=4.0, coulomb=(1.99, 0.12)
)

LIKE_WITHIN = 3.0
"""Times the rms within, of a twentieth of the samples at either end; it was some hundred times."""


def fitted(rig: TorqueRig, folder: Path, most: int = 0) -> Outcome:
    path = written(rig, 7, folder)
    text = path.read_text("utf-8").replace("max_effects = 4", f"max_effects = {most}")
    path.write_text(text, "utf-8")
    return run_scenario(read_scenario(path), folder=folder)


def left(one: ChannelComparison) -> np.ndarray:
    """(n,) of what counts."""
    return np.asarray(one.residual[one.counted])


@pytest.mark.long
def test_the_ends_of_a_torque_do_not_rule_its_error(tmp_path: Path) -> None:
    x = left(fitted(FAST_LINK, tmp_path).comparisons[0].channels[0])
    few = len(x) // 20
    within = rms(x[few:-few])
    assert rms(x[:few]) < LIKE_WITHIN * within and rms(x[-few:]) < LIKE_WITHIN * within


FAST_PAIR = TorqueRig((4.0, 2.5), (0.5, 0.4), rate=2000.0, bits=13, counts=0.3, seconds=2.0)

MEAN = 0.3
"""Of the rms: a mean of noise with some tens of independent samples; it was twice the rms."""


@pytest.mark.long
def test_the_square_of_a_noisy_speed_is_no_torque(tmp_path: Path) -> None:
    channels = [c for r in fitted(FAST_PAIR, tmp_path).comparisons for c in r.channels]
    for x in map(left, channels):
        assert abs(x.mean()) < MEAN * rms(x)


@pytest.mark.long
def test_a_loop_that_feeds_its_encoders_back_hides_none_of_their_noise(tmp_path: Path) -> None:
    """The torque foretells what the encoders read; their noise was taken for a fourth of what it
    is, and what is left beside the friction for something that is not listed."""
    found = fitted(SLOW_PAIR, tmp_path, most=2).diagnosis
    assert found is not None and found.final_verdict == "nothing_missing"
    assert [s.added for s in found.steps] == [None, "coulomb_friction"]


@pytest.mark.long
def test_a_torque_that_its_own_loop_makes_rough_is_not_noisy(tmp_path: Path) -> None:
    """The viscous friction is 2 % of a torque that the feedback of a coarse encoder shakes by three
    times as much from sample to sample."""
    rig = TorqueRig((3.0,), (0.6,), rate=2000.0, bits=14, counts=0.3, seconds=3.0, viscous=(0.08,))
    found = fitted(rig, tmp_path, most=2).diagnosis
    assert found is not None
    assert [s.added for s in found.steps] == [None, "viscous_friction"]
    values = {e.name: e.value for e in found.parameters}
    assert values["fv1"] == pytest.approx(0.08, rel=0.05)
