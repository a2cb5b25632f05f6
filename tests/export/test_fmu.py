"""The exported FMU, run by FMPy, against our own motions."""

from __future__ import annotations

import io
import zipfile
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from flexgui.core.recording.inputs import TIME
from flexgui.export.formats import fmu as module
from flexgui.export.formats.fmu import compiler, fmu, library_place, shared_library
from tests.export.helpers import MODELS, outcome_of
from tests.export.whole import (
    SAMPLES,
    STEP,
    WHOLE,
    assert_same_motion,
    motion,
    random_point,
    rates_by_hand,
    whole_outcome,
)

fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed: pip install '.[test]'")

SAME_MOTION = 1e-6
"""Of a signal's rms; both integrators were asked for a hundredth of it or less."""

SAME = 1e-9
"""Relative to one and the rate: two orders of the same sums."""

HELD = ["formula", "limited drive"]
"""Of the others the code inside was stepped elsewhere. A unit holds its inputs over a step;
recorded torques run straight in our simulation."""


@cache
def unit_of(name: str) -> bytes:
    return fmu(whole_outcome(name))


@pytest.fixture
def unit(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    if compiler() is None:
        pytest.skip("there is no C compiler (cc, gcc or clang) on this machine")
    path = tmp_path / "model.fmu"
    path.write_bytes(unit_of(request.param))
    return path


def whole(names: list[str]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize(("unit", "name"), [(n, n) for n in names], indirect=["unit"])


@pytest.mark.parametrize("unit", ["formula", "slide", "recorded torque"], indirect=True)
def test_the_unit_is_valid(unit: Path) -> None:
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(unit)) == []


def instance(unit: Path, kind: str, made: str):  # type: ignore[no-untyped-def]
    """A running instance, and name -> value reference."""
    from fmpy import fmi3

    description = fmpy.read_model_description(str(unit))
    one = getattr(fmi3, kind)(
        guid=description.guid, unzipDirectory=fmpy.extract(str(unit)), instanceName="one",
        modelIdentifier=getattr(description, made).modelIdentifier,
    )  # fmt: skip
    one.instantiate()
    one.enterInitializationMode()
    return one, {v.name: v.valueReference for v in description.modelVariables}


@whole(HELD)
def test_fmpy_steps_it_as_we_simulate(unit: Path, name: str) -> None:
    model, (task, ours), outcome = WHOLE[name], motion(name), whole_outcome(name)
    equations = outcome.state_equations
    assert equations is not None
    slave, reference = instance(unit, "FMU3Slave", "coSimulation")
    x = [reference[f"x.{each.name}"] for each in equations.states]
    y = [reference[f"y.{each.name}"] for each in equations.outputs]
    given = [i for i, each in enumerate(equations.inputs) if each.name != TIME]
    r = [reference[f"r.{equations.inputs[i].name}"] for i in given]
    slave.setFloat64(x[: len(task.start)], list(task.start))
    slave.exitInitializationMode()
    states, outputs = [], []
    for sample, signals in enumerate(task.signals):
        slave.setFloat64(r, list(signals[given]))
        states.append(slave.getFloat64(x))
        outputs.append(slave.getFloat64(y))
        if sample + 1 < SAMPLES:
            slave.doStep(task.time[sample], STEP)
    slave.terminate()
    slave.freeInstance()
    q = np.array(states)[:, : model.arm.coordinates]
    assert_same_motion(model, q, np.array(outputs), ours.trajectory, outcome, SAME_MOTION)


@whole(["formula", "dry friction"])
def test_its_rates_for_a_solver_of_the_importer_are_ours(unit: Path, name: str) -> None:
    model, outcome = WHOLE[name], whole_outcome(name)
    equations = outcome.state_equations
    assert equations is not None
    one, reference = instance(unit, "FMU3Model", "modelExchange")
    one.exitInitializationMode()
    one.enterContinuousTimeMode()
    x, r = random_point(outcome, 4)
    for value, each in zip(r, equations.inputs, strict=True):
        if each.name == TIME:
            one.setTime(value)
        else:
            one.setFloat64([reference[f"r.{each.name}"]], [value])
    one.setContinuousStates((fmpy.fmi3.fmi3Float64 * len(x))(*x), len(x))
    found = (fmpy.fmi3.fmi3Float64 * len(x))()
    one.getContinuousStateDerivatives(found, len(x))
    asked = one.getFloat64([reference[f"der(x.{each.name})"] for each in equations.states])
    one.terminate()
    one.freeInstance()
    expected = rates_by_hand(model, model.numbers(), x, r)
    np.testing.assert_allclose(list(found), expected, rtol=SAME, atol=SAME)
    np.testing.assert_array_equal(asked, list(found))


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
@pytest.mark.parametrize("unit", ["limited drive"], indirect=True)
def test_simulate_fmu_needs_no_more_than_the_file(unit: Path, kind: str) -> None:
    result = fmpy.simulate_fmu(
        str(unit), fmi_type=kind, stop_time=0.05, output_interval=STEP,
        start_values={"r.theta1_ref": 0.2}, output=["x.theta1", "y.u1"],
    )  # fmt: skip
    assert result["x.theta1"][-1] > 0.0
    assert result["y.u1"].max() == pytest.approx(25.0 * 1.5, rel=1e-9)  # the limit of the current


@pytest.mark.parametrize("unit", ["dry friction"], indirect=True)
def test_parameters_and_units_are_those_that_were_found(unit: Path) -> None:
    equations = whole_outcome("dry friction").state_equations
    assert equations is not None
    description = fmpy.read_model_description(str(unit))
    variables = {v.name: v for v in description.modelVariables}
    for each in equations.parameters:
        assert float(variables[f"k.{each.name}"].start) == each.value
    units = {name: v.unit for name, v in variables.items()}
    assert units["x.v1_1"] == "1/m"
    assert units["k.fc1"] == units["y.u1"] == "N m"
    assert units["der(x.dtheta1)"] == "rad/(s s)"
    base = {u.name: u.baseUnit for u in description.unitDefinitions}
    assert (base["N m"].kg, base["N m"].m, base["N m"].s) == (1, 2, -2)
    assert base["N m s/rad"].rad == -1


def test_it_holds_sources_description_and_a_library_of_this_platform() -> None:
    content = fmu(outcome_of(MODELS["loop 1-1"]))
    names = zipfile.ZipFile(io.BytesIO(content)).namelist()
    assert {"modelDescription.xml", "sources/fmi3.c", "sources/flexarm.c", "sources/flexarm.h",
            "sources/buildDescription.xml"} <= set(names)  # fmt: skip
    assert (f"binaries/{library_place()}" in names) == (compiler() is not None)


def test_without_a_compiler_it_says_so_and_holds_sources(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "shared_library", lambda sources: None)
    archive = zipfile.ZipFile(io.BytesIO(fmu(outcome_of(MODELS["loop 1-1"]))))
    assert not [name for name in archive.namelist() if name.startswith("binaries")]
    assert "no C compiler" in archive.read("modelDescription.xml").decode()


def test_what_does_not_compile_gives_no_library() -> None:
    assert shared_library({"broken.c": "this is no C"}) is None
