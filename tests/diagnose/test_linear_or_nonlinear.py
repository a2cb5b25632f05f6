"""The level of a model: linear where that is as good, and never a missing effect of the arm."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flexgui.core.diagnose.base_fit import _check_counted
from flexgui.core.errors import InputError
from flexgui.core.recording.recording import Recording
from flexgui.core.results import Outcome
from flexgui.core.scenario.schema import Scenario
from flexgui.core.workbench import run_scenario
from flexgui.sentences.identifiability import notes
from tests.marks import long_except

SAME = 0.02
"""Relative, of EI from a start that is far off: a few deviations of two short recordings."""


def scenario(snr: float | None, amplitude: float, **more: Any) -> Scenario:
    recordings = [
        {
            "name": f"r{k}",
            "simulate": {
                "theta2": theta2, "seconds": 1.0, "seed": k, "amplitude": amplitude,
                **({} if snr is None else {"snr_db": snr}),
            },
        }
        for k, theta2 in enumerate((0.8, 1.6))
    ]  # fmt: skip
    document = {
        "title": "level",
        "arm": {"preset": "paper"},
        "drive": {"kind": "velocity_loop", "gains": [60.0, 30.0]},
        "identify": {"parameters": ["EI"]},
        "recordings": recordings,
    } | more
    return Scenario.model_validate(document)


def run(document: Scenario) -> Outcome:
    return run_scenario(document, folder=Path())


def test_small_motions_under_much_noise_need_no_more_than_the_linear_model() -> None:
    sensors = {"camera_noise": 2e-3, "encoder_noise": 2e-3, "deflection_noise": 2e-3}
    found = run(scenario(None, 0.05, sensors=sensors))
    assert found.level == "lpv"
    assert "it differs from the full" in notes(found)[0]


def test_large_motions_seen_well_need_the_full_equations() -> None:
    sensors = {"camera_noise": 3e-5, "encoder_noise": 1e-5, "deflection_noise": 1e-5}
    found = run(scenario(None, 0.6, sensors=sensors))
    assert found.level == "nonlinear"
    assert "full equations" in notes(found)[0]


@pytest.mark.parametrize("factor", long_except((0.25,), (0.25, 0.7, 1.3, 4.0)))
def test_a_nominal_stiffness_that_is_far_off_is_found_and_nothing_else(factor: float) -> None:
    sensors = {"camera_noise": 3e-5, "encoder_noise": 1e-5, "deflection_noise": 1e-5}
    document = scenario(
        None, 0.3, sensors=sensors, diagnose={"max_effects": 2},
        identify={"parameters": ["EI"], "start": {"EI": factor * 520.8333}},
    )  # fmt: skip
    found = run(document)
    assert found.diagnosis is not None
    assert found.diagnosis.verdict == "nothing_missing"
    assert found.diagnosis.effects == ()
    (stiffness,) = [e for e in found.diagnosis.parameters if e.name == "EI"]
    assert stiffness.value == pytest.approx(520.8333, rel=SAME)


def test_what_the_linear_model_misses_is_no_missing_effect() -> None:
    sensors = {"camera_noise": 3e-5, "encoder_noise": 1e-5, "deflection_noise": 1e-5}
    document = scenario(
        None, 0.6, sensors=sensors, model={"level": "lpv"}, diagnose={"max_effects": 3}
    )
    found = run(document).diagnosis
    assert found is not None
    assert found.verdict == "nothing_missing"
    assert found.effects == ()
    assert found.linear_model is not None
    assert found.linear_model.tip_rms is not None
    assert found.linear_model.full_equations_tip_rms is not None
    assert found.linear_model.tip_rms > 2.0 * found.linear_model.full_equations_tip_rms


@pytest.mark.long
def test_the_stiffness_that_is_stated_in_the_end_is_that_of_the_model_with_what_was_found() -> None:
    """Identified without the friction that is there, it is biased."""
    sensors = {"camera_noise": 3e-5, "encoder_noise": 1e-5, "deflection_noise": 1e-5}
    document = scenario(None, 0.3, sensors=sensors, diagnose={"max_effects": 2})
    hidden = tuple(
        r.model_copy(update={"hidden": {"viscous_friction": {"fv1": 6.0, "fv2": 3.0}}})
        for r in document.recordings
    )
    found = run(document.model_copy(update={"recordings": hidden})).diagnosis
    assert found is not None
    assert [e["id"] for e in found.effects] == ["viscous_friction"]
    at = {e.name: e.value for e in found.parameters}
    assert at["EI"] == pytest.approx(520.8333, rel=SAME)
    assert at["fv1"] == pytest.approx(6.0, rel=SAME)
    assert found.origins["fv1"] == "viscous_friction"
    assert found.origins["EI"] == "arm"


def test_of_a_long_recording_the_part_decides_in_which_the_joints_move_most() -> None:
    t = np.arange(10_000) * 1e-3
    place = np.where((t > 6.0) & (t < 7.0), np.sin(20.0 * t), 0.0)
    whole = Recording("r", t, {"theta1": place, "theta1_ref": t}, counted={"theta1": t > 1.0})
    part = whole.excerpt(2_000)
    assert len(part.time) == 2_000 and part.excerpt(2_000) is part
    assert np.ptp(part["theta1"]) == np.ptp(place)
    assert part.sample_time == pytest.approx(whole.sample_time)
    assert part.mask("theta1").all()


def test_a_channel_of_which_no_sample_counts_is_named() -> None:
    experiment = SimpleNamespace(counted=np.zeros((5, 1), dtype=bool), channels=(("z1", "m"),))
    with pytest.raises(InputError, match="No sample of z1 counts"):
        _check_counted([experiment])
