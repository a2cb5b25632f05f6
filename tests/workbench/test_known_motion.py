"""A joint whose inertia is known over time: a further joint moves as recorded, its torque nowhere.

The rig: a heavy first joint with friction, whose torque is recorded, carries a second link that
another controller swings through most of a turn; a late gauge reads the first link.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexgui.core.errors import InputError
from flexgui.core.loading import load_recordings
from flexgui.core.progress import Silent
from flexgui.core.results import Outcome
from flexgui.core.scenario.read import parse_scenario
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.core.workbench import run_scenario
from tests.workbench.test_rigs_as_they_are import CLOSE, DELAY, FILE, LATE_GAUGE, estimates, keep

RIG = """
title = "A joint whose inertia is known over time"
[arm]
segments = [
  {{ length = 0.4, mass = 2.0, EI = {EI}, modes = 1, hub_inertia = {Jh}, damping_time = 0.01 }},
  {{ length = 0.35, mass = {m2}, modes = 0, hub_inertia = 0.2 }},
]
[drive]
{drive}
[model]
level = "nonlinear"
effects = [{effects}]
[sensors]
encoder_noise = 1e-5
deflection_noise = 1e-4
[identify]
parameters = [{parameters}]
filter = {{ cutoff_hz = 60.0 }}
generations = 0
[[recordings]]
name = "rig"
{recording}
"""
TRUE = {"EI": 90.0, "Jh": 0.3, "m2": 1.6}
BOTH_DRIVEN = 'kind = "torque"'
"""The rig, whose second torque nobody records."""
SWING = """
simulate = { seconds = 3.0, amplitude = 3.0, hold = 0.25, seed = 5, theta = [0.0, 1.2] }
hidden = { coulomb_friction = { fc1 = 0.5, fc2 = 0.3 }, sensor_delay = { tg1 = 4e-3 } }
"""
LED = 'kind = "torque"\nknown_motion = [2]'


def written(drive: str, recording: str = FILE, **changed: object) -> Scenario:
    settings = {"effects": "", "parameters": "", **TRUE, **changed}
    text = RIG.format(drive=drive, recording=recording, **settings)
    return parse_scenario(text, "rig.toml")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The rig's file: no torque of the second joint."""
    made = written(BOTH_DRIVEN, SWING)
    (recording,) = load_recordings(made, base_model(made), Path(), None, Silent())
    assert np.ptp(recording["theta2"]) > 2.0  # rad: the inertia changes by a third or more
    into = tmp_path_factory.mktemp("known_motion")
    keep(recording, into, "u1", "theta1", "theta2", "deflection1")
    return into


def fitted(folder: Path, drive: str = LED, **changed: object) -> Outcome:
    plain = {"EI": 120.0, "Jh": 0.2, "effects": LATE_GAUGE, "parameters": '"EI1", "Jh1"'}
    return run_scenario(written(drive, **{**plain, **changed}), folder=folder)


def test_a_joint_whose_inertia_is_known_over_time_is_right(folder: Path) -> None:
    found = fitted(folder)
    values = estimates(found)
    assert values["Jh1"] == pytest.approx(TRUE["Jh"], rel=CLOSE)
    assert values["EI1"] == pytest.approx(TRUE["EI"], rel=CLOSE)
    assert values["fc1"] == pytest.approx(0.5, rel=CLOSE)
    assert values["tg1"] == pytest.approx(4e-3, abs=DELAY)
    assert {t.joint for t in found.comparisons[0].missing_torque} == {1}


def test_the_motion_that_is_known_tells_the_mass_of_the_link_that_moves(folder: Path) -> None:
    """Its inertia about the first joint changes as the recorded motion says, and only so."""
    values = estimates(fitted(folder, m2=1.2, parameters='"Jh1", "m2"', EI=TRUE["EI"]))
    assert values["m2"] == pytest.approx(TRUE["m2"], rel=CLOSE)
    assert values["Jh1"] == pytest.approx(TRUE["Jh"], rel=CLOSE)


def test_what_was_said_of_the_joints_that_move_by_themselves_is_not_read(folder: Path) -> None:
    """A torque constant for each joint is what a drive has; that of the second is no matter."""
    model = base_model(written(LED + "\ntorque_constants = [2.0, 7.0]"))
    assert model.drive.needed_channels(model.arm) == ("i1", "theta2")
    assert "kt1" in model.parameters and "kt2" not in model.parameters


@pytest.mark.parametrize(
    ("drive", "words"),
    [
        ('kind = "held"\nknown_motion = [2]', "follow their encoders already"),
        ('kind = "torque"\nknown_motion = [1, 2]', "names every joint"),
        ('kind = "torque"\nknown_motion = [3]', "the arm has 2 joints"),
        ('kind = "torque"\nknown_motion = [2, 2]', "each once"),
        ('kind = "torque"\nknown_motion = 2', "a list of joints"),
    ],
)
def test_a_known_motion_that_has_no_place_is_refused(drive: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        base_model(written(drive))
