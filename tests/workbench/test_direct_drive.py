"""A rotor without a gear turns with the segment that carries it, and is found as such."""

from __future__ import annotations

from pathlib import Path

import pytest

from flexgui.core.results import Diagnosis, Estimate
from flexgui.core.scenario.schema import Scenario
from flexgui.core.workbench import run_scenario

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
    scenario = Scenario.model_validate({
        "title": "Rotors",
        "arm": {"preset": "paper"},
        "drive": {"kind": "velocity_loop", "gains": [60.0, 30.0]},
        "model": {"level": "nonlinear"},
        "sensors": {"camera_noise": 3e-5, "encoder_noise": 1e-5},
        "identify": {"parameters": ["EI1", "EI2"]},
        "diagnose": {"max_effects": 2, "candidates": LIKE_IT},
        "recordings": rows,
    })  # fmt: skip
    found = run_scenario(scenario, folder=Path()).diagnosis
    assert found is not None
    return found


def by_name(found: Diagnosis) -> dict[str, Estimate]:
    return {e.name: e for e in found.parameters}


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
    known = by_name(found)
    for name, size in hidden.items():
        assert known[name].value == pytest.approx(size, abs=SIZED * ROTOR)
    for name in ("EI1", "EI2"):
        assert known[name].value == pytest.approx(EI, rel=STIFF)
