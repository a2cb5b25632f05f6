"""The generator against the beam's textbook, Newton's law and itself with half the step."""

from __future__ import annotations

import gzip
import tomllib
from pathlib import Path

import numpy as np
import pytest

from tests.programs.mujoco.files import CAMERA_NOISE

mujoco = pytest.importorskip("mujoco", reason="needs MuJoCo: pip install '.[test]'")
pytestmark = pytest.mark.long

from tests.programs.mujoco.cases import CASES, EXPERIMENTS, Case  # noqa: E402
from tests.programs.mujoco.chain import PAPER, Beam, clamped  # noqa: E402
from tests.programs.mujoco.excitation import SAMPLE  # noqa: E402
from tests.programs.mujoco.files import (  # noqa: E402
    COLUMNS,
    DECIMALS,
    table,
)
from tests.programs.mujoco.generate import FOLDER  # noqa: E402
from tests.programs.mujoco.simulate import run  # noqa: E402

BEAM_TOLERANCE = 0.005
"""The chain stands for the beam within this; its own error is about 1/(4 N²), 0.06 %."""
FREQUENCIES = (1.8751041, 4.6940911)
"""Roots of cos(x) cosh(x) = -1: a clamped beam turns with x² sqrt(EI / (μ l⁴)) rad/s."""
SMALL = 1e-4
"""m of deflection: large for the engine's digits, small for its geometry (2e-4 of the length)."""
LAST_DIGIT = 1.5 * 10.0 ** -np.array(DECIMALS)
"""Another processor may round the last digit the other way."""

CASE = {case.name: case for case in CASES}


def _tip(data: mujoco.MjData) -> np.ndarray:
    return np.array(data.site("tip").xpos[:2])


def _masses(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """M (nv, nv) of the engine, row by row: what turns a unit acceleration into forces."""
    columns = np.empty((model.nv, model.nv))
    for i, unit in enumerate(np.eye(model.nv)):
        mujoco.mj_mulM(model, data, columns[i], unit)
    return columns


@pytest.mark.parametrize("beam", PAPER, ids=["segment 1", "segment 2"])
def test_a_tip_force_bends_the_chain_as_the_beam(beam: Beam) -> None:
    model = mujoco.MjModel.from_xml_string(clamped(beam, 1e-5))
    data = mujoco.MjData(model)
    force = SMALL * 3 * beam.EI / beam.length**3
    for _ in range(20):  # hinge by hinge: geometry couples them by no more than the deflection
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        data.qfrc_applied[:] = 0.0
        place = np.array(data.site("tip").xpos)
        push = np.array([0.0, force, 0.0])
        mujoco.mj_applyFT(model, data, push, np.zeros(3), place, model.nbody - 1, data.qfrc_applied)
        missing = data.qfrc_applied + data.qfrc_passive
        data.qpos += missing / model.jnt_stiffness
    assert np.abs(missing).max() < 1e-9 * force
    compliance = _tip(data)[1] / force
    assert compliance == pytest.approx(beam.length**3 / (3 * beam.EI), rel=BEAM_TOLERANCE)


@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize("beam", PAPER, ids=["segment 1", "segment 2"])
def test_the_clamped_chain_swings_as_the_beam(beam: Beam, number: int) -> None:
    step = 1e-5
    model = mujoco.MjModel.from_xml_string(clamped(beam, step))
    data = mujoco.MjData(model)
    data.qpos[:] = _shape(model, data, number - 1)
    expected = FREQUENCIES[number - 1] ** 2 * np.sqrt(beam.EI / (beam.mass * beam.length**3))
    sideways = []
    for _ in range(round(3.2 * 2 * np.pi / expected / step)):
        mujoco.mj_step(model, data)
        sideways.append(_tip(data)[1])
    crossings = np.flatnonzero(np.diff(np.sign(sideways)))
    y = np.array(sideways)
    times = step * (crossings + y[crossings] / (y[crossings] - y[crossings + 1]))
    measured = np.pi * (len(times) - 1) / (times[-1] - times[0])
    assert measured == pytest.approx(expected, rel=BEAM_TOLERANCE)


HALVING = 0.1 * CAMERA_NOISE
"""m. What the camera could see is its noise; a tenth of it also stays below the encoder's. Friction
and a torque limit keep it at their finer steps."""


def _halving(case: Case, seconds: float) -> float:
    """m: how far the tip moves at most when the case's step is halved."""
    reference = EXPERIMENTS[2].reference[: round(seconds / SAMPLE) + 1]
    coarse = run(case.plant, EXPERIMENTS[2].theta2, reference, case.step)
    fine = run(case.plant, EXPERIMENTS[2].theta2, reference, case.step / 2)
    return float(np.linalg.norm(coarse.tip - fine.tip, axis=1).max())


@pytest.mark.parametrize(
    ("name", "seconds"), [("joint_elasticity", 0.2), ("coulomb_friction", 0.06)]
)
def test_half_the_step_gives_the_same_motion(name: str, seconds: float) -> None:
    assert _halving(CASE[name], seconds) < HALVING


def _shape(model: mujoco.MjModel, data: mujoco.MjData, number: int) -> np.ndarray:
    """Hinge angles (nv,) in rad of one mode, the tip SMALL m off: where free motion starts."""
    mujoco.mj_forward(model, data)
    root = np.sqrt(model.jnt_stiffness)
    slowest = np.linalg.eigh(np.linalg.inv(_masses(model, data) / np.outer(root, root)))
    shape = slowest.eigenvectors[:, number] / root
    data.qpos[:] = 1e-6 * shape
    mujoco.mj_kinematics(model, data)
    return 1e-6 * shape * SMALL / _tip(data)[1]


def _read(path: Path) -> tuple[list[str], np.ndarray]:
    header, *lines = gzip.decompress(path.read_bytes()).decode().splitlines()
    return header.split(","), np.array([[float(c) for c in line.split(",")] for line in lines])


@pytest.mark.parametrize("case", CASES, ids=lambda c: c.name)
def test_the_stored_recordings_are_whole(case: Case) -> None:
    for experiment in EXPERIMENTS:
        header, rows = _read(FOLDER / case.name / f"{experiment.name}.csv.gz")
        assert tuple(header) == COLUMNS
        assert rows.shape == (len(experiment.reference), len(COLUMNS))
        assert np.array_equal(rows[:, 1:3], experiment.reference)
        assert rows[:, 0] == pytest.approx(SAMPLE * np.arange(len(rows)), abs=1e-9)


def test_the_stored_truth_is_that_of_the_cases() -> None:
    stored = tomllib.loads((FOLDER / "truth.toml").read_text(encoding="utf-8"))
    assert stored == {case.name: case.effects for case in CASES}


@pytest.mark.parametrize("name", ["nothing", "structural_damping-camera_delay"])
def test_a_stored_recording_can_be_made_again(name: str) -> None:
    case, experiment = CASE[name], EXPERIMENTS[4]
    reference = experiment.reference[:101]
    again = table(name, experiment.name, run(case.plant, experiment.theta2, reference, case.step))
    _, stored = _read(FOLDER / name / f"{experiment.name}.csv.gz")
    assert np.all(np.abs(again - stored[:101]) < LAST_DIGIT)
