"""A rotor without a gear turns with the segment that carries it, and is found as such."""

from __future__ import annotations

from pathlib import Path

import pytest

from flexgui.core.results import Diagnosis
from flexgui.core.scenario.read import read_scenario
from flexgui.core.workbench import run_scenario
from tests.diagnose.fits import diagnosis_of, on_paper
from tests.programs.sample.forty_rigs import cases

EI = 520.8333
"""N m², of both segments of the paper's arm."""

SIZED = 0.02
"""Relative: what a size may be off."""

STIFF = 0.01
"""The same of a stiffness."""

ROTOR = 0.15
"""kg m² of the second joint's."""


LIKE_IT = ["rotor_inertia", "tip_payload", "link_mass_error", "viscous_friction"]
"""Effects that are as heavy, and one that is not."""


def diagnosed(hidden: dict[str, float]) -> Diagnosis:
    rows = [
        {
            "simulate": {"theta2": angle, "seconds": 1.5, "seed": seed},
            "hidden": {"rotor_inertia": hidden},
        }
        for seed, angle in enumerate((0.6, 1.4, 2.2))
    ]
    return diagnosis_of(on_paper(
        sensors={"camera_noise": 3e-5, "encoder_noise": 1e-5},
        identify={"parameters": ["EI1", "EI2"]},
        diagnose={"max_effects": 2, "candidates": LIKE_IT},
        recordings=rows,
    ))  # fmt: skip


@pytest.mark.parametrize(
    "hidden",
    [
        {"Jh1": 0.0, "Jh2": 0.0, "Jr2": ROTOR},
        pytest.param({"Jh1": 0.0, "Jh2": ROTOR, "Jr2": 0.0}, marks=pytest.mark.long),
    ],
    ids=["direct drive", "behind a gear"],
)
def test_a_rotor_is_found_with_the_law_that_it_follows(hidden: dict[str, float]) -> None:
    found = diagnosed(hidden)
    assert [s.added for s in found.steps] == [None, "rotor_inertia"]
    assert found.final_verdict == "nothing_missing"
    known = {e.name: e for e in found.parameters}
    for name, size in hidden.items():
        assert known[name].value == pytest.approx(size, abs=SIZED * ROTOR)
    for name in ("EI1", "EI2"):
        assert known[name].value == pytest.approx(EI, rel=STIFF)


CLOSE = 0.02
"""Relative: of masses and compliances."""


@pytest.mark.long
@pytest.mark.parametrize(
    "name",
    [
        pytest.param("rigs/4_rigid_1_joint_elasticity", id="one"),
        pytest.param("rigs/9_rigid_2_joint_elasticity", id="two"),
        pytest.param("rigs/14_rigid_3_joint_elasticity", id="three"),
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
