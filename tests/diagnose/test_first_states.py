"""Recordings that begin in mid-motion: what their free first states take up, and what shapes have
some."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest

from flexgui.core.arm.arm import Arm
from flexgui.core.diagnose.base_fit import BaseFit
from flexgui.core.diagnose.bending_shapes import arm_with_modes
from flexgui.core.diagnose.fit_problem import FitProblem, parametrised
from flexgui.core.diagnose.refit import fit, refit_with
from flexgui.core.effects import effect
from flexgui.core.identify.unknowns import first_state_names
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


def stiff_fit(data: FitProblem) -> dict[str, float]:
    """Values of a fit with beams that are too stiff: first states take up what they can."""
    arm = {u.label: STIFF * u.parameter.value for u in data.nuisance if u.recording is None}
    others = tuple(u for u in data.nuisance if u.label not in arm)
    held = replace(data, nuisance=others, fixed={**data.fixed, **arm}, anchor=None)
    return {**fit(parametrised(held, [], {}), None, lambda: False, 20).parametrised.values(), **arm}


def test_a_refit_finds_the_friction_that_first_states_had_taken_up() -> None:
    """It kept them, and the slopes of beams ten times too stiff, at every start."""
    data = replace(cut().data, anchor=None)
    base = parametrised(data, [], stiff_fit(data))
    slopes = base.slopes(base.vector)
    sizes = {name: 0.5 * x for name, x in TRUE.items()}
    friction = [effect("viscous_friction")]
    found = refit_with(data, base, friction, sizes, no_whitening, slopes, (), lambda: False)
    assert found.cost < 1.2 * data.count
    values = found.parametrised.values()
    assert values["EI1"] == pytest.approx(values["EI2"], rel=0.02)
    assert {name: values[name] for name in TRUE} == pytest.approx(TRUE, rel=0.02)


@pytest.mark.parametrize("modes", [(1, 1), (2, 1), (3, 3)])
def test_further_bending_shapes_have_first_states_of_their_own(modes: tuple[int, int]) -> None:
    data = cut().data
    arm: Arm = arm_with_modes(data.bare.arm, modes)
    other = data.of_arm(replace(data.bare, arm=arm))
    free = [u.parameter.name for u in other.nuisance if u.recording is not None]
    assert sorted(free) == sorted(first_state_names(other.bare))
    again = other.of_arm(data.bare)
    assert {u.label for u in again.nuisance} == {u.label for u in data.nuisance}
