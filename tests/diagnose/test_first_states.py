"""Recordings that begin in mid-motion: what their free first states take up, and what shapes have
some."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy
from hypothesis import given
from hypothesis import strategies as st

from flexgui.core.arm.arm import Arm
from flexgui.core.diagnose.base_fit import BaseFit
from flexgui.core.diagnose.bending_shapes import arm_with_modes
from flexgui.core.effects import effect
from flexgui.core.estimate.fit_result import fit, refit_with
from flexgui.core.estimate.problem import FitData, problem_of
from flexgui.core.identify.first_states import first_state_names, followed_first_state
from flexgui.core.model import Model
from flexgui.core.noise.whitening import no_whitening
from tests.diagnose.fits import begun, on_paper

TRUE = {"fv1": 6.0, "fv2": 3.0}
STIFF = 10.0
"""Times the true stiffness, to which fits without the friction were driven."""


@cache
def cut() -> BaseFit:
    """Without the friction, of recordings that begin half a second after their motion."""
    moving = {
        "window": [0.5, 1.2],
        "simulate": {"theta2": 1.2, "seconds": 1.2},
        "hidden": {"viscous_friction": TRUE},
    }
    return begun(on_paper(
        sensors={"camera_noise": 3e-5, "encoder_noise": 1e-5},
        identify={"parameters": ["EI1", "EI2"], "output": ["z", "encoder"], "initial_state": True},
        recordings=[moving],
    ))  # fmt: skip


def stiff_fit(data: FitData) -> dict[str, float]:
    """Values of a fit with beams that are too stiff: first states take up what they can."""
    arm = {u.label: STIFF * u.parameter.value for u in data.nuisance if u.recording is None}
    others = tuple(u for u in data.nuisance if u.label not in arm)
    held = replace(data, nuisance=others, fixed={**data.fixed, **arm}, anchor=None)
    return {**fit(problem_of(held, [], {}), None, lambda: False, 20).problem.values(), **arm}


def test_a_refit_finds_the_friction_that_first_states_had_taken_up() -> None:
    """It kept them, and the slopes of beams ten times too stiff, at every start."""
    data = replace(cut().data, anchor=None)
    base = problem_of(data, [], stiff_fit(data))
    slopes = base.slopes(base.vector)
    sizes = {name: 0.5 * x for name, x in TRUE.items()}
    friction = [effect("viscous_friction")]
    found = refit_with(data, base, friction, sizes, no_whitening, slopes, (), lambda: False)
    assert found.cost < 1.2 * data.count
    values = found.problem.values()
    assert values["EI1"] == pytest.approx(values["EI2"], rel=0.02)
    assert {name: values[name] for name in TRUE} == pytest.approx(TRUE, rel=0.02)


@pytest.mark.parametrize("modes", [(1, 1), (2, 1), (3, 3)])
def test_further_bending_shapes_have_first_states_of_their_own(modes: tuple[int, int]) -> None:
    data = cut().data
    arm: Arm = arm_with_modes(data.bare.arm, modes)
    other = data.for_bare(replace(data.bare, arm=arm))
    free = [u.parameter.name for u in other.nuisance if u.recording is not None]
    assert sorted(free) == sorted(first_state_names(other.bare, 1e-3))
    again = other.for_bare(data.bare)
    assert {u.label for u in again.nuisance} == {u.label for u in data.nuisance}


def arm_of(modes: int) -> Model:
    return (
        cut()
        .data.for_bare(
            replace(cut().data.bare, arm=arm_with_modes(cut().data.bare.arm, (modes, modes)))
        )
        .bare
    )


@pytest.mark.parametrize("sample_time", [5e-4, 2e-3, 1e-2, 5e-2])
@pytest.mark.parametrize("modes", [1, 2, 3])
def test_as_many_numbers_are_free_as_samples_may_show_vibrations(
    modes: int, sample_time: float
) -> None:
    """By the poles of the linear model with its joints held, whose stiffness is known within a
    factor of four."""
    model = arm_of(modes)
    joints, n = model.arm.joints, model.arm.coordinates
    p = model.numbers().p
    K, _ = model.compiled.linear_matrices(np.zeros(n), p)
    M = model.compiled.mass_matrix(np.zeros(n), p)
    rates = np.sqrt(np.linalg.eigvals(np.linalg.solve(M[joints:, joints:], K[joints:, joints:])))
    shown = int(np.sum(rates.real < 2.0 * np.pi / sample_time))
    names = first_state_names(model, sample_time)
    assert len(names) == 2 * (joints + max(shown, 1))


@given(st.lists(st.floats(-0.1, 0.1), min_size=4, max_size=4))
def test_what_is_not_free_follows_along_the_slowest_vibrations(
    state: list[float],
) -> None:
    """The free numbers stay, and the fastest vibrations have no part in the state."""
    model, sample_time = arm_of(3), 5e-3
    names, joints = model.arm.coordinate_names, model.arm.joints
    free = [f.removeprefix("start_") for f in first_state_names(model, sample_time)]
    free = [f for f in free if f in names[joints:]]
    assert 1 < len(free) < len(names) - joints
    own = np.zeros(len(names))
    own[[names.index(f) for f in free]] = (state * 2)[: len(free)]
    found = followed_first_state(model, free, own)
    assert found[[names.index(f) for f in free]] == pytest.approx((state * 2)[: len(free)])
    p, n = model.numbers().p, model.arm.coordinates
    K, _ = model.compiled.linear_matrices(np.zeros(n), p)
    M = model.compiled.mass_matrix(np.zeros(n), p)[joints:, joints:]
    _, shapes = scipy.linalg.eigh(0.5 * (K + K.T)[joints:, joints:], M)
    amplitudes = shapes.T @ M @ found[joints:]
    assert np.abs(amplitudes[len(free) :]).max() < 1e-9 * max(np.abs(amplitudes).max(), 1e-12)


def test_what_a_person_states_of_a_first_state_stays_as_it_is() -> None:
    model = arm_of(3)
    own = np.arange(model.arm.coordinates, dtype=float)
    for stated in (model.arm.coordinate_names[2:], ("v1_3",), ("theta1",)):
        assert followed_first_state(model, stated, own) == pytest.approx(own)
