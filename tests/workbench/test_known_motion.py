"""A joint whose inertia is known over time: a further joint moves as recorded, its torque nowhere.

The rig: a heavy first joint with friction, whose torque is recorded, carries a second link that
another controller swings through most of a turn; a late gauge reads the first link.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flexgui.core.errors import InputError
from flexgui.core.results import Outcome
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.core.workbench import run_scenario
from tests.workbench.test_rigs_as_they_are import (
    CLOSE,
    DELAY,
    LATE_GAUGE,
    estimates,
    keep,
    rig,
    simulated,
)

TRUE = {"EI": 90.0, "Jh": 0.3, "m2": 1.6}
SWING = {
    "simulate": {
        "seconds": 3.0, "amplitude": 3.0, "hold": 0.25, "seed": 5, "theta": [0.0, 1.2]
    },
    "hidden": {"coulomb_friction": {"fc1": 0.5, "fc2": 0.3}, "sensor_delay": {"tg1": 4e-3}},
}  # fmt: skip
LED = {"known_motion": [2]}


def written(EI: float, Jh: float, m2: float, drive: dict[str, Any], **more: Any) -> Scenario:
    segments = [
        {"length": 0.4, "mass": 2.0, "EI": EI, "modes": 1, "hub_inertia": Jh, "damping_time": 0.01},
        {"length": 0.35, "mass": m2, "modes": 0, "hub_inertia": 0.2},
    ]
    stated = {"kind": "torque", **drive}
    return rig({"segments": segments}, stated, filter={"cutoff_hz": 60.0}, **more)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The rig's file: no torque of the second joint."""
    recording = simulated(written(**TRUE, drive={}, recording=SWING))
    assert np.ptp(recording["theta2"]) > 2.0  # rad: the inertia changes by a third or more
    into = tmp_path_factory.mktemp("known_motion")
    keep(recording, into, "u1", "theta1", "theta2", "deflection1")
    return into


def fitted(folder: Path, EI: float, m2: float, *parameters: str) -> Outcome:
    plain = written(EI, 0.2, m2, LED, effects=LATE_GAUGE, parameters=parameters)
    return run_scenario(plain, folder=folder)


@pytest.mark.long
def test_a_joint_whose_inertia_is_known_over_time_is_right(folder: Path) -> None:
    found = fitted(folder, 120.0, TRUE["m2"], "EI1", "Jh1")
    values = estimates(found)
    assert values["Jh1"] == pytest.approx(TRUE["Jh"], rel=CLOSE)
    assert values["EI1"] == pytest.approx(TRUE["EI"], rel=CLOSE)
    assert values["fc1"] == pytest.approx(0.5, rel=CLOSE)
    assert values["tg1"] == pytest.approx(4e-3, abs=DELAY)
    assert {t.joint for t in found.comparisons[0].missing_torque} == {1}


def test_the_motion_that_is_known_tells_the_mass_of_the_link_that_moves(folder: Path) -> None:
    """Its inertia about the first joint changes as the recorded motion says, and only so."""
    values = estimates(fitted(folder, TRUE["EI"], 1.2, "Jh1", "m2"))
    assert values["m2"] == pytest.approx(TRUE["m2"], rel=CLOSE)
    assert values["Jh1"] == pytest.approx(TRUE["Jh"], rel=CLOSE)


def test_what_was_said_of_the_joints_that_move_by_themselves_is_not_read() -> None:
    """A torque constant for each joint is what a drive has; that of the second is no matter."""
    model = base_model(written(**TRUE, drive={**LED, "torque_constants": [2.0, 7.0]}))
    assert model.drive.needed_channels(model.arm) == ("i1", "theta2")
    assert "kt1" in model.parameters and "kt2" not in model.parameters


@pytest.mark.parametrize(
    ("drive", "words"),
    [
        ({"kind": "held", "known_motion": [2]}, "follow their encoders already"),
        ({"known_motion": [1, 2]}, "names every joint"),
        ({"known_motion": [3]}, "the arm has 2 joints"),
        ({"known_motion": [2, 2]}, "each once"),
        ({"known_motion": 2}, "a list of joints"),
    ],
)
def test_a_known_motion_that_has_no_place_is_refused(drive: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        base_model(written(**TRUE, drive=drive))
