"""Descents take as many steps per sample as their directions need, not only their errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexgui.core.arm.arm import Arm, Segment
from flexgui.core.diagnose.base_fit import substeps_for_directions
from flexgui.core.diagnose.fit_problem import FitProblem, parametrised
from flexgui.core.drives.velocity_loop import VelocityLoop
from flexgui.core.effects.sizes import typical
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.identify.unknowns import Unknown
from flexgui.core.model import Model
from flexgui.core.parameters import Parameter
from flexgui.core.sensors import sensor
from tests.helpers import from_rest, read, simulate_fixed

STEP, SAMPLES = 5e-3, 200
SWINGS = {"at half the sampling rate": 3300.0, "slowly": 3.3}
"""N m2: the stiffness of a link of 0.45 m, of which it swings at some 100 or 3 Hz."""

NEARLY = 0.8
"""Cosine with the exact direction: of a method of second order twice as many steps take three
quarters of the error away, so a sine of 0.44 between the two is one of 0.58 in all."""

ELSEWHERE = 0.5
"""Cosine below which a step takes less than a quarter of what there is to take."""

EXACTLY = 128
"""Steps per sample: twice as many move no direction any more."""

FEW = 4
"""Steps per sample; of a slow arm one would do."""


def data(EI: float) -> FitProblem:
    arm = Arm(segments=(Segment(length=0.45, mass=3.0, EI=EI, hub_inertia=0.05, modes=1),))
    bare = Model(arm, VelocityLoop(gains=(7.2,)), "nonlinear")
    rng = np.random.default_rng(1)
    speeds = 0.3 * np.sign(rng.standard_normal((SAMPLES // 10, 1))).repeat(10, axis=0)
    task = from_rest(bare, [0.2], speeds, STEP)
    motion = simulate_fixed(bare, bare.numbers(), task, EXACTLY)
    camera = sensor("z")
    one = prepare(bare, read(bare, task, motion, "z", "encoder"), [camera], Processing())
    unknown = Unknown(Parameter("EI1", EI, "N m²", 0.1 * EI, 10.0 * EI))
    floors = {c.name: 1e-4 for c in camera.channels(arm)}
    weights = (np.full(2, 1e4),)
    return FitProblem(bare, (one,), (unknown,), weights, floors, {}, typical(arm), 1)


def direction(of: FitProblem, steps: int) -> np.ndarray:
    h = parametrised(replace(of, substeps=steps), (), {})
    found = np.concatenate([S.ravel() for S in h.residuals.sensitivities(h.vector, central=False)])
    return np.asarray(found / np.linalg.norm(found))


@pytest.mark.parametrize("swings", SWINGS)
def test_a_descent_knows_which_way_its_parameters_lead(swings: str) -> None:
    of = data(SWINGS[swings])
    steps = substeps_for_directions(of, (), {}, 1)
    exact = direction(of, EXACTLY)
    assert direction(of, max(steps // 2, 1)) @ exact > NEARLY
    assert (steps > 1) is (swings == "at half the sampling rate")


def test_one_step_for_each_sample_leads_elsewhere_where_a_link_swings_fast() -> None:
    of = data(SWINGS["at half the sampling rate"])
    assert direction(of, 1) @ direction(of, EXACTLY) < ELSEWHERE


def test_no_fewer_than_what_errors_need() -> None:
    assert substeps_for_directions(data(SWINGS["slowly"]), (), {}, FEW) == FEW


def test_where_nothing_is_estimated_errors_decide() -> None:
    of = replace(data(SWINGS["at half the sampling rate"]), nuisance=())
    assert substeps_for_directions(of, (), {}, 1) == 1
