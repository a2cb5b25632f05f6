"""The exported FMU, run by FMPy, against the same model in SciPy."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest
import scipy.signal

from flexgui.export.formats import fmu as module
from flexgui.export.formats.fmu import compiler, fmu, library_place, shared_library
from flexgui.export.formats.python_control import ELBOW
from tests.export.helpers import MODELS, inputs, outcome_of
from tests.helpers import relative_to_largest

fmpy = pytest.importorskip("fmpy", reason="FMPy is not installed: pip install '.[test]'")

SAME = 1e-9
"""Relative: SciPy discretises without balancing the states."""

STEP, SAMPLES = 1e-3, 300
KICK = 0.01
"""rad, of the first joint at the start."""

NAMES = ["loop 2-2", "loop ground", "states of a drive", "torque"]


@pytest.fixture
def unit(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    if compiler() is None:
        pytest.skip("there is no C compiler (cc, gcc or clang) on this machine")
    path = tmp_path / "model.fmu"
    path.write_bytes(fmu(outcome_of(MODELS[request.param])))
    return path


@pytest.mark.parametrize("unit", NAMES, indirect=True)
def test_the_unit_is_valid(unit: Path) -> None:
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(unit)) == []


@pytest.mark.parametrize(("unit", "name"), [(n, n) for n in NAMES], indirect=["unit"])
def test_fmpy_runs_it_as_scipy_does(unit: Path, name: str) -> None:
    model = outcome_of(MODELS[name]).model
    u = inputs(SAMPLES, len(model.inputs))
    y = run(unit, model, u)
    E, A = (summed(terms, basis) for terms, basis in
            ((model.E_terms, model.basis), (model.A_terms, model.A_basis)))  # fmt: skip
    rate = (np.linalg.solve(E, A), np.linalg.solve(E, model.B), model.C, model.D)
    discrete = scipy.signal.StateSpace(*rate).to_discrete(STEP)
    x = np.zeros(len(model.states))
    x[0] = KICK
    expected = []
    for held in u:
        expected.append(model.C @ x + model.D @ held)
        x = discrete.A @ x + discrete.B @ held
    for one, other in zip(y.T, np.array(expected).T, strict=True):
        if other.any():
            assert relative_to_largest(one, other) < SAME


def summed(terms: np.ndarray, basis: tuple[str, ...]) -> np.ndarray:
    """The affine sum with every scheduled joint at a right angle."""
    import sympy as sp

    def at_elbow(text: str) -> float:
        found = sp.parse_expr(text)
        return float(found.subs(dict.fromkeys(found.free_symbols, ELBOW)))

    factors = [at_elbow(text) for text in basis]
    return np.asarray(sum(f * term for f, term in zip(factors, terms, strict=True)))


def run(unit: Path, model, u: np.ndarray) -> np.ndarray:  # type: ignore[no-untyped-def]
    """(N, ny): the outputs before each step, step by step through FMPy's own calls."""
    from fmpy.fmi3 import FMU3Slave

    description = fmpy.read_model_description(str(unit))
    reference = {v.name: v.valueReference for v in description.modelVariables}
    place = fmpy.extract(str(unit))
    slave = FMU3Slave(
        guid=description.guid, unzipDirectory=place, instanceName="one",
        modelIdentifier=description.coSimulation.modelIdentifier,
    )  # fmt: skip
    slave.instantiate()
    slave.enterInitializationMode()
    slave.setFloat64([reference[f"x.{model.states[0]}"]], [KICK])
    slave.exitInitializationMode()
    outputs = [reference[f"y.{name}"] for name in model.outputs]
    y = []
    for i, held in enumerate(u):
        slave.setFloat64([reference[f"u.{name}"] for name in model.inputs], list(held))
        y.append(slave.getFloat64(outputs))
        slave.doStep(i * STEP, STEP)
    slave.terminate()
    slave.freeInstance()
    return np.array(y)


@pytest.mark.parametrize("unit", ["loop 1-1"], indirect=True)
def test_simulate_fmu_needs_no_more_than_the_file(unit: Path) -> None:
    result = fmpy.simulate_fmu(
        str(unit), stop_time=0.1, output_interval=STEP,
        start_values={"u.dtheta1_ref": 0.2}, output=["x.theta1"],
    )  # fmt: skip
    assert result["x.theta1"][-1] > 0.0


def test_it_holds_sources_description_and_a_library_of_this_platform() -> None:
    content = fmu(outcome_of(MODELS["loop 1-1"]))
    names = zipfile.ZipFile(io.BytesIO(content)).namelist()
    assert {"modelDescription.xml", "sources/fmi3.c", "sources/flexmodel.c", "sources/flexmodel.h",
            "sources/buildDescription.xml"} <= set(names)  # fmt: skip
    assert (f"binaries/{library_place()}" in names) == (compiler() is not None)


def test_without_a_compiler_it_says_so_and_holds_sources(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "shared_library", lambda sources: None)
    archive = zipfile.ZipFile(io.BytesIO(fmu(outcome_of(MODELS["loop 1-1"]))))
    assert not [name for name in archive.namelist() if name.startswith("binaries")]
    assert "no C compiler" in archive.read("modelDescription.xml").decode()


def test_what_does_not_compile_gives_no_library() -> None:
    assert shared_library({"broken.c": "this is no C"}) is None
