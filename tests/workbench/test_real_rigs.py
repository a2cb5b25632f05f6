"""Recordings of real rigs: the figures that others found on them. They are not shipped."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from flexgui.core.results import Estimate, MissingTorque, Outcome, RecordingComparison
from flexgui.core.scenario.read import read_scenario
from flexgui.core.scenario.schema import DiagnoseSpec, Scenario
from flexgui.core.workbench import run_scenario

SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"

EMPS_ERROR = (0.67, 0.71)
"""Relative force error of a model with inertia alone; a study found 69.5 %."""
EMPS_MASS = (95.0, 98.0)
"""kg; published with all friction modelled: 95.1. Friction left out moves it a little."""

STEPS_ERROR = {"strain1": 0.45, "strain2": 0.20}
"""Normalised. Of a gauge read as the chord's angle a study reached 0.52 and 0.66 with coupling and
stiffness, 0.50 and 0.45 with damping; of the moment at the root, 0.406 and 0.174 are left."""

COUPLING = 2.0
"""By which factor the coupling of the stages lowers the error of strain2 at least."""


def data_folder(*files: str) -> Path:
    """Where the recordings are; skips with the reason where they are not."""
    folder = Path(os.environ.get("FLEXGUI_DATA", "no folder named"))
    for file in files:
        if not (folder / file).is_file():
            pytest.skip(f"the real recording {file} is not here: FLEXGUI_DATA is {folder}")
    return folder


def undiagnosed(name: str) -> Scenario:
    """A scenario without its diagnosis, which takes minutes."""
    scenario = read_scenario(SCENARIOS / name).model_copy(update={"diagnose": DiagnoseSpec()})
    scenario.model_fields_set.discard("diagnose")
    return scenario


@cache
def emps() -> Outcome:
    folder = data_folder("emps.csv")
    return run_scenario(undiagnosed("emps.toml"), folder=SCENARIOS, data_folder=folder)


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    folder = data_folder("quanser_2dsfl_steps.csv", "ctu_2dsfl_lqr.csv")
    return run_scenario(undiagnosed("bench_2dsfl.toml"), folder=SCENARIOS, data_folder=folder)


def comparison(outcome: Outcome, name: str, variant: str | None = None) -> RecordingComparison:
    place = outcome
    if variant is not None:
        place = next(v for v in outcome.variants if v.title == variant)  # type: ignore[assignment]
    return next(c for c in place.comparisons if c.recording == name)


def errors(found: RecordingComparison) -> dict[str, float]:
    """Normalised error by channel."""
    return {c.channel: c.normalised_error for c in found.channels}


def estimate(outcome: Outcome, name: str) -> Estimate:
    return next(e for e in outcome.fits[0].estimates if e.name == name)


def test_emps_has_the_published_mass_and_the_error_of_a_model_without_friction():
    found = emps()
    mass = estimate(found, "m1")
    assert EMPS_MASS[0] < mass.value < EMPS_MASS[1]
    assert mass.identifiable
    force = comparison(found, "emps").channels[0]
    assert EMPS_ERROR[0] < force.relative_error < EMPS_ERROR[1]


def test_emps_lacks_coulomb_and_viscous_friction():
    """Published: 20.4 N and 203.5 N s/m; a straight line over the velocity gives both."""
    (found,) = comparison(emps(), "emps").missing_torque
    assert (found.unit, found.velocity_unit) == ("N", "m/s")
    moving = found.counted & (np.abs(found.velocity) > 0.02)
    v, f = found.velocity[moving], found.missing[moving]
    regressors = np.column_stack([np.sign(v), v, np.ones_like(v)])
    step, slope, offset = np.linalg.lstsq(regressors, f, rcond=None)[0]
    assert step == pytest.approx(20.39, rel=0.1)
    assert slope == pytest.approx(203.5, rel=0.1)
    assert offset == pytest.approx(-3.165, abs=1.0)


@pytest.mark.long
def test_the_bench_is_fitted_as_well_as_coupling_and_damping_allow(outcome):
    found = errors(comparison(outcome, "steps"))
    for channel, bar in STEPS_ERROR.items():
        assert found[channel] < bar


@pytest.mark.long
def test_the_bench_is_worse_at_nominal_values(outcome):
    found = errors(comparison(outcome, "steps"))
    nominal = errors(comparison(outcome, "steps", "Coupled arm, nominal values"))
    for channel in STEPS_ERROR:
        assert found[channel] < nominal[channel]


@pytest.mark.long
def test_the_benchs_second_link_needs_the_coupling(outcome):
    found = errors(comparison(outcome, "steps"))
    for variant in outcome.variants:
        if variant.title.startswith("Two uncoupled stages"):
            alone = errors(comparison(outcome, "steps", variant.title))
            assert alone["strain2"] > COUPLING * found["strain2"]


@pytest.mark.long
def test_the_benchs_parameters_are_believable(outcome):
    for name in ("EI1", "EI2", "tau2"):
        found = estimate(outcome, name)
        assert found.identifiable
        assert found.std < abs(found.value)
        assert not found.at_bound


@pytest.mark.long
def test_both_joints_of_the_bench_lack_a_torque(outcome):
    for name in ("steps", "lqr"):
        missing: tuple[MissingTorque, ...] = comparison(outcome, name).missing_torque
        assert [m.joint for m in missing] == [1, 2]
        for m in missing:
            assert np.isfinite(m.missing[m.counted]).all()
            assert m.missing[m.counted].std() > 0.1 * m.applied[m.counted].std()


@pytest.mark.long
def test_the_other_bench_validates_with_its_own_zeros(outcome):
    found = comparison(outcome, "lqr")
    assert found.role == "validate"
    assert "offset_strain1, offset_strain2" in found.note
    assert all(error < 1.0 for c, error in errors(found).items() if c in STEPS_ERROR)


@pytest.mark.long
def test_the_other_bench_is_predicted_to_a_third(outcome):
    found = errors(comparison(outcome, "lqr"))
    assert found["strain1"] < 0.25
    assert found["strain2"] < 0.33


def test_a_missing_folder_is_told(tmp_path):
    from flexgui.core.errors import InputError

    scenario = read_scenario(SCENARIOS / "emps.toml")
    with pytest.raises(InputError, match=r"emps\.csv was not found.*FLEXGUI_DATA"):
        run_scenario(scenario, folder=SCENARIOS, data_folder=tmp_path)


ARM_THAT_HARDLY_MOVES = """
title = "An arm that hardly moves"

[arm]
gravity = [0.0, -9.81]

[[arm.segments]]
length = 0.44
mass = 1.5
EI = 80.0

[[arm.segments]]
length = 0.41
mass = 1.0
EI = 80.0

[drive]
kind = "torque"
torque_constants = [10.0, 10.0]

[identify]
parameters = ["EI1", "EI2"]

[diagnose]
max_effects = 2

[[recordings]]
file = "rigs/merit1.csv"
window = [0.0, 20.0]
{columns}

[[recordings]]
file = "rigs/merit2.csv"
window = [10.0, 30.0]
role = "validate"
{columns}
"""
"""Of TU Dortmund's arm, with torque constants and gains of the gauges that nobody knows."""

MERIT_COLUMNS = """columns = { theta1 = "q2", theta2 = "q3", i1 = "I2", i2 = "I3", \
deflection1 = { name = "eps21", gain = 1e-5 }, deflection2 = { name = "eps31", gain = 1e-5 } }"""


@pytest.mark.long
def test_of_a_real_arm_that_hardly_moves_nobody_says_that_nothing_is_missing(tmp_path) -> None:
    """Its model explains nothing of the gauges, and misses another recording by far."""
    folder = data_folder("rigs/merit1.csv", "rigs/merit2.csv")
    path = tmp_path / "arm.toml"
    text = ARM_THAT_HARDLY_MOVES.replace("{columns}", MERIT_COLUMNS)
    path.write_text(text, encoding="utf-8")
    found = run_scenario(read_scenario(path), folder=tmp_path, data_folder=folder).diagnosis
    assert found is not None
    assert {found.verdict, found.final_verdict}.isdisjoint({"nothing_missing"})
