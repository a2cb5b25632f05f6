"""Soft joints of rigs whose torque is recorded, from plain files."""

from __future__ import annotations

from pathlib import Path

import pytest

from flexgui.core.scenario.read import read_scenario
from flexgui.core.workbench import run_scenario
from tests.programs.sample.forty_rigs import cases

CLOSE = 0.02
"""Relative: of masses and compliances."""


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("rigs/4_rigid_1_joint_elasticity", id="one"),
        pytest.param("rigs/9_rigid_2_joint_elasticity", id="two", marks=pytest.mark.long),
        pytest.param("rigs/14_rigid_3_joint_elasticity", id="three", marks=pytest.mark.long),
    ],
)
def test_soft_joints_are_found_with_their_sizes(name: str, tmp_path: Path) -> None:
    """They swing at 8 Hz without damping: the screen sees no size, the first swings show it."""
    case = cases()[name]
    path = case.write(tmp_path)
    found = run_scenario(read_scenario(path), folder=tmp_path).diagnosis
    assert found is not None and found.final_verdict == "nothing_missing"
    assert found.kept == ("joint_elasticity",)
    values = {e.name: e.value for e in found.parameters}
    for parameter, true in case.truth.items():
        assert values[parameter] == pytest.approx(true, rel=CLOSE)
