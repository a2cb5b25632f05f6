"""The exported C code, compiled and stepped, against our own simulation of the linear model."""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np
import pytest

from flexgui.core.model import Model
from flexgui.core.results import Outcome
from flexgui.core.simulate.linear import respond
from flexgui.core.simulate.motion import Task
from flexgui.core.simulate.posture_interpolation import midpoints
from flexgui.export.expressions import in_c
from flexgui.export.formats.arm_c import FOLDER as ARM_FOLDER
from flexgui.export.formats.arm_c import ArmC
from flexgui.export.formats.c_code import FOLDER, CCode, c_sources
from flexgui.export.model_format import scheduled
from tests.export.helpers import MODELS, doubles, inputs, needs_compiler, outcome_of, shared_object
from tests.helpers import relative_to_largest, straight

SAME = 1e-12
"""Relative to the largest value of each output: two implementations of the same exact step."""

SAMPLES, STEP = 2000, 1e-3


def stepped(
    outcome: Outcome, room: Path, start: np.ndarray, postures: np.ndarray, u: np.ndarray
) -> np.ndarray:
    """(N, ny) outputs; the struct of the header is doubles from its first to its last member."""
    code, model = shared_object(c_sources(outcome), room), outcome.model
    nx, nu = len(model.states), len(model.inputs)
    memory = np.zeros(nx + 1 + max(postures.shape[1], 1) + nx * nx + nx * nu)
    code.flexmodel_init(doubles(memory))
    memory[:nx] = start
    y = np.zeros((len(u), len(model.outputs)))
    for i, held in enumerate(u):
        code.flexmodel_output(doubles(memory), doubles(held), doubles(y[i]))
        failed = code.flexmodel_advance(
            doubles(memory), doubles(postures[i]), doubles(held), ctypes.c_double(STEP)
        )
        assert not failed
    return y


def schedule(model: Model, sweeps: bool) -> np.ndarray:
    """(SAMPLES, n): a posture, or a motion about it by half a radian."""
    rest = straight(np.linspace(0.5, 1.3, model.arm.joints), model.arm)
    rows = np.repeat(rest[None], SAMPLES, axis=0)
    if sweeps:
        swing = 0.5 * np.sin(3.0 * STEP * np.arange(SAMPLES))
        rows[:, : model.arm.joints] += swing[:, None]
    return rows


@needs_compiler
@pytest.mark.parametrize("sweeps", [False, True], ids=["at a posture", "along a sweep"])
@pytest.mark.parametrize("name", MODELS)
def test_the_step_is_that_of_our_own_simulation(name: str, sweeps: bool, tmp_path: Path) -> None:
    model = MODELS[name]
    outcome, rows = outcome_of(model), schedule(model, sweeps)
    u = inputs(SAMPLES, len(outcome.model.inputs))
    start = np.zeros(len(outcome.model.states))
    start[: model.arm.joints] = rows[0, : model.arm.joints]
    held = rows if sweeps else rows[:1]
    ours = respond(model, [model.numbers()], [Task(STEP * np.arange(SAMPLES), u, start, held)])[0]
    names = scheduled((*outcome.model.basis, *outcome.model.A_basis))
    which = [model.arm.coordinate_names.index(n) for n in names]
    y = stepped(outcome, tmp_path, start, midpoints(rows)[:, which], u)
    own_states = outcome.model.C[:, 2 * model.arm.coordinates :]
    expected = np.hstack([ours.q, ours.v]) @ outcome.model.C[:, : -own_states.shape[1] or None].T
    if own_states.any():  # torques of a drive with states of its own are not in q and q'
        kept = ~own_states.any(axis=1)
        y, expected = y[:, kept], expected[:, kept]
        direct = outcome.model.D[kept]
    else:
        direct = outcome.model.D
    expected = expected + u @ direct.T
    for one, other in zip(y.T, expected.T, strict=True):
        assert relative_to_largest(one, other) < SAME


@needs_compiler
def test_the_matrices_are_made_once_for_a_posture(tmp_path: Path) -> None:
    """What lies after the states in the struct stays where posture and step stay."""
    outcome = outcome_of(MODELS["loop 1-1"])
    code, model = shared_object(c_sources(outcome), tmp_path), outcome.model
    nx, nu = len(model.states), len(model.inputs)
    memory, u = np.zeros(nx + 2 + nx * nx + nx * nu), np.ones(nu)
    for expected_change, theta in ((True, 0.4), (False, 0.4), (True, 0.5)):
        before = memory[nx:].copy()
        code.flexmodel_advance(
            doubles(memory), doubles(np.array([theta])), doubles(u), ctypes.c_double(STEP)
        )
        assert (not np.array_equal(before, memory[nx:])) == expected_change


def test_functions_of_the_posture_in_c_and_nothing_else() -> None:
    names = ("theta1", "theta2", "theta3")
    assert in_c("1", names) == "1.0"
    assert in_c("-sin(theta2 + theta3)", names) == "(-sin((theta[1] + theta[2])))"
    assert in_c("0.5*theta1**2", names) == "(0.5 * (theta[0]*theta[0]))"
    for text in ("system(1)", "theta9", "__import__('os')", "lambda: 1"):
        with pytest.raises(ValueError, match="no translation of"):
            in_c(text, ("theta1",))


EVIL = 'evil */ int main(){} /* \n#include "x" \\'


@pytest.mark.parametrize(("format", "name"), [(CCode(), "flexmodel"), (ArmC(), "flexarm")])
def test_two_files_take_no_memory_hold_nothing_global_and_a_title_in_a_comment(
    format: CCode | ArmC, name: str
) -> None:
    files = format.files(outcome_of(MODELS["loop 1-1"], EVIL))
    folder = {CCode: FOLDER, ArmC: ARM_FOLDER}[type(format)]
    source, header = (files.pop(f"{folder}/{name}.{end}").decode() for end in "ch")
    assert not files
    assert not [word for word in ("malloc", "calloc", "alloca", "stdlib") if word in source]
    lines = [line for line in source.splitlines() if line.startswith("static ") and "(" not in line]
    assert lines and all(line.startswith("static const") for line in lines)
    comment = header[: header.index(f"#ifndef {name.upper()}_H")].rstrip()
    assert comment.startswith("/*") and comment.find("*/") == len(comment) - 2
