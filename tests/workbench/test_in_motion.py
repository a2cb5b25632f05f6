"""Recordings that somebody cut out of a longer log: the arm moves when they begin, and a plain
scenario says nothing of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexgui.core.arm.presets import presets
from flexgui.core.drives.torque import Torque
from flexgui.core.effects import effect
from flexgui.core.identify.first_states import first_state_names
from flexgui.core.identify.setup import IN_MOTION, make_setup
from flexgui.core.model import Model
from flexgui.core.recording.recording import Beginning, Recording
from flexgui.core.recording.save import save_recording
from flexgui.core.results import NOTHING, Outcome
from flexgui.core.scenario.read import parse_scenario
from flexgui.core.scenario.schema import IdentifySpec, Scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.core.simulate.nonlinear import simulate_within
from flexgui.core.workbench import run_scenario
from tests.helpers import from_rest

STEP, SAMPLES, HOLD = 4e-3, 400, 5
CUT = 83
"""Samples, a third of a second."""

COUNT = 2.0 * np.pi / 2**18
"""rad, of the encoder"""

DRAG = 1.0
"""N m s/rad"""

DEVIATIONS = 4.0
"""Of a right answer; each of some ten numbers exceeds three once in forty campaigns."""

FAR = 5.0
"""Noise floors that a model from rest misses these recordings by, at least."""

PLAIN = """
title = "A log that was cut"
[arm]
segments = [{{ length = 0.46, mass = 3.5, EI = {EI}, hub_inertia = 0.04, modes = 1 }}]
[drive]
{drive}
[identify]
parameters = ["EI1"]
{more}
[diagnose]
max_effects = {most}
[[recordings]]
file = "a.csv"
[[recordings]]
file = "b.csv"
[[recordings]]
file = "c.csv"
[[recordings]]
file = "d.csv"
role = "validate"
"""

DRIVES = {
    "loop": ('kind = "velocity_loop"\ngains = [8.0]', 0.4),
    "torque": ('kind = "torque"', 3.0),
}


def scenario(drive: str, EI: float, more: str = "", most: int = 3) -> Scenario:
    text = PLAIN.format(EI=EI, drive=DRIVES[drive][0], more=more, most=most)
    return parse_scenario(text, "rig.toml")


def write(folder: Path, drive: str, cut: int) -> None:
    """A rig with viscous friction and an EI of 545."""
    bare = base_model(scenario(drive, 545.0)).at_level("nonlinear")
    model = bare.with_effects([effect("viscous_friction")], {"fv1": DRAG})
    rng, time = np.random.default_rng(7), np.arange(SAMPLES) * STEP
    (reference,) = model.drive.reference_channels(model.arm)
    for name in "abcd":
        signal = DRIVES[drive][1] * np.repeat(rng.choice([-1.0, 1.0], SAMPLES // HOLD), HOLD)
        task = from_rest(model, [0.1], signal[:, None], STEP)
        moved = simulate_within(model, model.numbers(), task, 1e-8).trajectory
        place = moved.joint_positions[:, 0] + 0.5 * COUNT * rng.standard_normal(SAMPLES)
        channels = {reference: signal, "theta1": COUNT * np.round(place / COUNT)}
        channels = {k: x[cut:] for k, x in channels.items()}
        save_recording(Recording(name, time[: SAMPLES - cut], channels), folder / f"{name}.csv")


def run(folder: Path, drive: str, more: str = "", most: int = 3) -> Outcome:
    """From a stiffness a third off."""
    return run_scenario(scenario(drive, 380.0, more, most), folder=folder)


@pytest.mark.long
@pytest.mark.parametrize("drive", DRIVES)
def test_what_is_hidden_is_found_although_the_arm_moves_already(tmp_path: Path, drive) -> None:
    write(tmp_path, drive, CUT)
    outcome = run(tmp_path, drive)
    said = outcome.diagnosis
    assert said is not None and IN_MOTION in outcome.notes
    assert said.final_verdict == NOTHING
    assert said.steps[-1].model == ("viscous_friction",)
    found = {p.name: (p.value, p.std) for p in said.parameters}
    for name, true in (("EI1", 545.0), ("fv1", DRAG)):
        assert abs(found[name][0] - true) < DEVIATIONS * found[name][1]


@pytest.mark.long
def test_a_scenario_may_say_that_they_begin_at_rest(tmp_path: Path) -> None:
    write(tmp_path, "loop", CUT)
    outcome = run(tmp_path, "loop", "initial_state = false", 0)
    assert IN_MOTION not in outcome.notes
    assert outcome.diagnosis is not None
    last = outcome.diagnosis.steps[-1]
    assert max(e.rms / e.floor for e in last.errors) > FAR


@pytest.mark.long
def test_what_begins_at_rest_has_no_starts_to_estimate(tmp_path: Path) -> None:
    write(tmp_path, "loop", 0)
    outcome = run(tmp_path, "loop", most=0)
    assert IN_MOTION not in outcome.notes
    assert not any(e.name.startswith("start_d") for fit in outcome.fits for e in fit.estimates)


def test_a_rigid_arm_that_its_encoders_lead_has_no_first_state() -> None:
    """As EMPS, which dry friction holds until it breaks loose: nothing is estimated or said."""
    model = Model(presets()["single_axis"], Torque(), "nonlinear")
    time = np.arange(100) * STEP
    channels = {"u1": np.ones(100), "theta1": np.cos(3.0 * time)}
    recording = Recording("r", time, channels, beginning=Beginning.MOTION)
    setup = make_setup(model, IdentifySpec(parameters=("m1",)), [recording])
    assert first_state_names(setup.model, STEP) == ()
    assert IN_MOTION not in setup.notes
