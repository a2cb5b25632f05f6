"""The exported C code of the non-linear model, compiled, against our own equations and motions."""

from __future__ import annotations

import ctypes
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
import pytest

from flexgui.core.drives.prescribed_joints import PrescribedJoints
from flexgui.core.effects import catalogue
from flexgui.core.model import Model
from flexgui.core.results import Outcome
from flexgui.export.formats.arm_c import ArmC, arm_sources
from tests.export.helpers import MODELS, doubles, needs_compiler, outcome_of, shared_object
from tests.export.whole import (
    SAMPLES,
    STEP,
    WHOLE,
    assert_same_motion,
    ends,
    motion,
    random_point,
    rates_by_hand,
    whole_outcome,
)
from tests.helpers import ARMS, PAPER, looped

SAME = 1e-9
"""Relative to one and the rate: two orders of the same sums, and a mass matrix of condition 1e4."""

SAME_MOTION = 1e-6
"""Of a signal's rms; both integrators were asked for a hundredth of it or less."""


class Compiled:
    """The library, and the memory of its struct: x, k, step, tolerance."""

    def __init__(self, outcome: Outcome, room: Path) -> None:
        equations = outcome.state_equations
        assert equations is not None
        self.library, self.equations = shared_object(arm_sources(outcome), room), equations
        self.states = len(equations.states)
        room_of_k = max(len(equations.inputs), len(equations.parameters), 1)
        self.memory = np.zeros(self.states + room_of_k + 2)
        self.library.flexarm_init(doubles(self.memory))
        self.x, self.k = self.memory[: self.states], self.memory[self.states :]

    def rates(self, x: np.ndarray, r: np.ndarray) -> np.ndarray:
        out = np.zeros(self.states)
        self.library.flexarm_rates(*map(doubles, (self.k, x, r, out)))
        return out

    def output(self, r: np.ndarray) -> np.ndarray:
        out = np.zeros(len(self.equations.outputs))
        self.library.flexarm_output(*map(doubles, (self.k, self.x, r, out)))
        return out

    def advance(self, r: np.ndarray, end: np.ndarray, seconds: float) -> bool:
        where = (doubles(self.memory), doubles(r), doubles(end))
        return not self.library.flexarm_advance(*where, ctypes.c_double(seconds))


@cache
def compiled_whole(name: str) -> Compiled:
    return Compiled(whole_outcome(name), Path(mkdtemp()))


@needs_compiler
@pytest.mark.parametrize("name", WHOLE)
def test_rates_at_random_states_are_those_of_arm_drive_and_laws(name: str) -> None:
    code, model = compiled_whole(name), WHOLE[name]
    for seed in range(20):
        x, r = random_point(whole_outcome(name), seed)
        expected = rates_by_hand(model, model.numbers(), x, r)
        np.testing.assert_allclose(code.rates(x, r), expected, rtol=SAME, atol=SAME)


@needs_compiler
@pytest.mark.parametrize("name", WHOLE)
def test_the_motion_is_that_of_our_own_simulation(name: str) -> None:
    code, model, (task, ours) = compiled_whole(name), WHOLE[name], motion(name)
    code.library.flexarm_init(doubles(code.memory))
    code.x[: len(task.start)] = task.start
    states, outputs = [], []
    for sample, r in enumerate(task.signals):
        states.append(code.x.copy())
        outputs.append(code.output(r))
        if sample + 1 < SAMPLES:
            assert code.advance(r, ends(model, task, sample), STEP)
    q = np.array(states)[:, : model.arm.coordinates]
    trajectory = ours.trajectory
    assert_same_motion(
        model, q, np.array(outputs), trajectory, whole_outcome(name), SAME_MOTION
    )  # fmt: skip


@needs_compiler
@pytest.mark.parametrize(
    ("model", "some"),
    [
        (WHOLE["elastic joints"], {"m1", "EI2", "c1", "lambda2"}),
        # The inertia of a rigid segment follows its mass.
        (looped(ARMS["0-2-1"], 20.0), {"m1", "m2", "EI3"}),
    ],
    ids=["elastic joints", "0-2-1"],
)
def test_a_changed_parameter_changes_the_rates_as_it_changes_the_model(
    model: Model, some: set[str], tmp_path: Path
) -> None:
    outcome = outcome_of(model)
    code = Compiled(outcome, tmp_path)
    x, r = random_point(outcome, 1)
    changed = {}
    for i, parameter in enumerate(code.equations.parameters):
        changed[parameter.name] = code.k[i] = 1.3 * parameter.value + 0.01
    assert some <= set(changed)
    expected = rates_by_hand(model, model.numbers(changed), x, r)
    np.testing.assert_allclose(code.rates(x, r), expected, rtol=SAME, atol=SAME)


@needs_compiler
def test_a_step_that_cannot_be_made_leaves_the_state(tmp_path: Path) -> None:
    code = Compiled(whole_outcome("dry friction"), tmp_path)
    r = np.array([np.nan, 0.0])
    code.x[0] = 0.3
    before = code.x.copy()
    assert not code.advance(r, r, STEP)
    np.testing.assert_array_equal(code.x, before)


@needs_compiler
@pytest.mark.parametrize("name", ["one mode", "ground", "0-2-1"])
def test_every_shape_of_arm_compiles_without_a_warning(name: str, tmp_path: Path) -> None:
    model = looped(ARMS[name], 20.0)
    outcome = outcome_of(model)
    x, r = random_point(outcome, 2)
    expected = rates_by_hand(model, model.numbers(), x, r)
    found = Compiled(outcome, tmp_path).rates(x, r)
    np.testing.assert_allclose(found, expected, rtol=SAME, atol=SAME)


def test_the_header_names_every_number_with_its_unit_and_what_is_missing() -> None:
    model = looped(PAPER).with_effects(
        [catalogue()[kind] for kind in ("coulomb_friction", "camera_delay")]
    )
    header = " ".join(arm_sources(outcome_of(model))["flexarm.h"].split())
    assert "x[4] dtheta1 in rad/s" in header
    assert "r[1] dtheta2_ref in rad/s" in header
    assert "FLEXARM_K_fc1" in header
    carried, _, missing = header.partition("but NOT in this file")
    assert "Coulomb friction" in carried
    assert "Camera delay" in missing


def test_joints_that_follow_their_recording_have_no_equations_of_motion() -> None:
    outcome = outcome_of(Model(PAPER, PrescribedJoints()))
    assert "joints follow" in ArmC().unable(outcome)
    assert not ArmC().unable(outcome_of(MODELS["loop 1-1"]))
    assert ArmC().unable(replace(outcome_of(MODELS["loop 1-1"]), state_equations=None))
