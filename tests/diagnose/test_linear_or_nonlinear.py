"""The level of a model: linear where that is as good, and never a missing effect of the arm."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from flexgui.core.recording.recording import Recording
from flexgui.core.scenario.schema import Scenario
from flexgui.core.workbench import run_scenario
from flexgui.sentences.identifiability import notes
from tests.diagnose.fits import diagnosis_of, on_paper
from tests.marks import long_except

SAME = 0.02
"""Relative, of EI from a start that is far off: a few deviations of two short recordings."""

ASKED = {
    "max_effects": 2,
    "candidates": ["viscous_friction", "tip_payload", "joint_elasticity", "camera_delay"],
}

SHARP = {"camera_noise": 3e-5, "encoder_noise": 1e-5, "deflection_noise": 1e-5}
NOISY = dict.fromkeys(SHARP, 2e-3)


def scenario(amplitude: float, sensors: dict[str, float] = SHARP, **more: Any) -> Scenario:
    recordings = [
        {
            "name": f"r{k}",
            "simulate": {"theta2": theta2, "seconds": 1.0, "seed": k, "amplitude": amplitude},
        }
        for k, theta2 in enumerate((0.8, 1.6))
    ]
    tables = {"model": {}, "identify": {"parameters": ["EI"]}, "sensors": sensors, **more}
    return on_paper(recordings=recordings, **tables)


@pytest.mark.parametrize(
    ("amplitude", "sensors", "level", "said"),
    [
        (0.05, NOISY, "lpv", "it differs from the full"),
        (0.6, SHARP, "nonlinear", "full equations"),
    ],
    ids=["small motions under much noise", "large motions seen well"],
)
def test_the_linear_model_is_chosen_where_the_noise_hides_what_it_misses(
    amplitude: float, sensors: dict[str, float], level: str, said: str
) -> None:
    found = run_scenario(scenario(amplitude, sensors))
    assert found.level == level
    assert said in notes(found)[0]


@pytest.mark.parametrize("factor", long_except((0.25,), (0.25, 0.7, 1.3, 4.0)))
def test_a_nominal_stiffness_that_is_far_off_is_found_and_nothing_else(factor: float) -> None:
    identify = {"parameters": ["EI"], "start": {"EI": factor * 520.8333}}
    found = diagnosis_of(scenario(0.3, diagnose=ASKED, identify=identify))
    assert found.verdict == "nothing_missing"
    assert found.effects == ()
    (stiffness,) = [e for e in found.parameters if e.name == "EI"]
    assert stiffness.value == pytest.approx(520.8333, rel=SAME)


def test_what_the_linear_model_misses_is_no_missing_effect() -> None:
    found = diagnosis_of(scenario(0.6, model={"level": "lpv"}, diagnose=ASKED))
    assert found.verdict == "nothing_missing"
    assert found.effects == ()
    assert found.linear_model is not None
    assert found.linear_model.tip_rms is not None
    assert found.linear_model.full_equations_tip_rms is not None
    assert found.linear_model.tip_rms > 2.0 * found.linear_model.full_equations_tip_rms


def test_of_a_long_recording_the_part_decides_in_which_the_joints_move_most() -> None:
    t = np.arange(10_000) * 1e-3
    place = np.where((t > 6.0) & (t < 7.0), np.sin(20.0 * t), 0.0)
    whole = Recording("r", t, {"theta1": place, "theta1_ref": t}, counted={"theta1": t > 1.0})
    part = whole.excerpt(2_000)
    assert len(part.time) == 2_000 and part.excerpt(2_000) is part
    assert np.ptp(part["theta1"]) == np.ptp(place)
    assert part.sample_time == pytest.approx(whole.sample_time)
    assert part.mask("theta1").all()
