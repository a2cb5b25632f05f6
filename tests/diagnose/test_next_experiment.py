"""Planned experiments: the expected score is what a refit finds, and fast motion parts two lags."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from flexgui.core.diagnose.base_fit import fit_base
from flexgui.core.diagnose.evidence import TIE
from flexgui.core.diagnose.next_experiment import (
    NAME,
    _unabsorbed,
    expected_score,
    next_experiments,
    planned_data,
    possible_experiments,
    problem_on,
    shared_normal_matrix,
)
from flexgui.core.effects import effect
from flexgui.core.estimate.fit_result import fit
from flexgui.core.estimate.problem import FitData, Problem, problem_of
from flexgui.core.identify.prepared_recording import prepare
from flexgui.core.identify.setup import make_setup
from flexgui.core.least_squares import cost_of, levenberg_marquardt
from flexgui.core.model import Model
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.scenario.schema import IdentifySpec
from flexgui.core.simulate.experiment import NoiseLevels, simulate_recording
from tests.helpers import PAPER, looped
from tests.identify.helpers import simulated, without

CAMERA, ENCODER = 3e-5, 1e-5
"""m and rad, rms of the sensors' noise."""
NOISE = NoiseLevels({"z": CAMERA, "encoder": ENCODER})
STATED = {"z1": CAMERA, "z2": CAMERA, "theta1": ENCODER, "theta2": ENCODER}

LINEAR = 0.15
"""Relative: the score is a linear prediction of what a refit, which is not, leaves."""

ITERATIONS = 12


@dataclass(frozen=True)
class Pair:
    """Two effects fitted to recordings that have the first."""

    data: FitData
    first: Problem
    second: Problem


def recorded(model: Model, kind: str, sizes: Mapping[str, float], **spec: Any) -> list[Recording]:
    """By encoders and a camera: a gauge that lags too would tell the effects apart."""
    true = model.with_effects([effect(kind)], sizes)
    given = {"seconds": 1.0, "level": true.level, **spec}
    made = simulated(true, points=(0.9, 2.0), seed=0, noise=NOISE, **given)
    return [without(r, "deflection") for r in made]


def pair(level: str, first: str, sizes: Mapping[str, float], second: str, **spec: Any) -> Pair:
    model = looped(PAPER, level=level)
    recordings = recorded(model, first, sizes, **spec)
    asked = IdentifySpec(parameters=("EI1", "EI2"), output=("z", "encoder"), generations=0)
    setup = make_setup(model, asked, recordings)
    begun = fit_base(setup.model, setup.outputs, setup.processing, asked, recordings, STATED, 1e-3)
    start = begun.base.problem.values()
    both = [
        fit(problem_of(begun.data, [effect(kind)], start), None, lambda: False, ITERATIONS)
        for kind in (first, second)
    ]
    return Pair(begun.data, both[0].problem, both[1].problem)


@cache
def lags() -> Pair:
    """A delay and a lag of the camera, recorded while the arm moves slowly."""
    return pair("nonlinear", "camera_delay", {"td": 2e-3}, "sensor_lag", hold=0.2)


def spec(**settings: Any) -> SimulateSpec:
    return SimulateSpec(theta2=1.2, seconds=1.0, **settings)


def test_the_score_is_what_a_refit_of_the_rival_leaves() -> None:
    """Oracle: simulate the truth on the planned experiment and refit the rival to it alone."""
    p = lags()
    planned = spec(hold=0.02)
    there = planned_data(p.data, planned)
    truth, rival = problem_on(there, p.first), problem_on(there, p.second)
    y = truth.residuals.predictor.predict(truth.vector)[0]
    weights = there.weights[0]

    def errors(vector: np.ndarray) -> list[np.ndarray]:
        return [(y - rival.residuals.predictor.predict(vector)[0]) * weights]

    left = levenberg_marquardt(errors, rival.slopes, rival.vector, rival.limits, most=30)
    scores = [expected_score(p.data, *both, planned) for both in
              ((p.first, p.second), (p.second, p.first))]  # fmt: skip
    assert scores[0] == pytest.approx(scores[1])
    assert scores[0] <= left.cost * (1.0 + LINEAR)
    assert cost_of(errors(rival.vector)) >= left.cost
    apart = errors(rival.vector)[0]
    assert _unabsorbed(rival, apart, {}) == pytest.approx(left.cost, rel=LINEAR)


def test_an_effect_cannot_be_told_from_itself() -> None:
    p = lags()
    assert expected_score(p.data, p.first, p.first, spec()) == 0.0


def test_what_is_known_already_can_only_raise_the_score() -> None:
    p = lags()
    known = [shared_normal_matrix(p.first), shared_normal_matrix(p.second)]
    alone = expected_score(p.data, p.first, p.second, spec())
    assert expected_score(p.data, p.first, p.second, spec(), known) >= alone * (1.0 - 1e-6)


def test_fast_motion_parts_a_delay_from_a_lag() -> None:
    p = lags()
    slow, fast = spec(hold=0.2), spec(hold=0.02)
    found = next_experiments(
        p.data, p.first, p.second, ("Camera delay", "Slow sensor"), (slow, fast)
    )
    assert [e.simulate.get("hold", 0.02) for e in found] == [0.02, 0.2]
    assert found[0].score > 3.0 * found[1].score
    assert found[0].between == ("Camera delay", "Slow sensor") and found[0].unit == "rad/s"
    assert found[0].score > TIE


def test_twice_the_amplitude_gives_four_times_the_score_of_linear_models() -> None:
    p = lags()
    one, two = (expected_score(p.data, p.first, p.second, spec(amplitude=a)) for a in (0.2, 0.4))
    assert two == pytest.approx(4.0 * one, rel=1e-3)


def test_the_proposed_experiment_decides_once_it_is_made() -> None:
    """Made with the first effect and noise, the refits of both differ by the expected score."""
    p = lags()
    best = next_experiments(
        p.data, p.first, p.second, ("a", "b"), possible_experiments(p.data)[:4]
    )[0]
    model = looped(PAPER, level="nonlinear")
    model = model.with_effects([effect("camera_delay")], p.first.values())
    planned = SimulateSpec(**best.simulate)
    made = simulate_recording(model, planned, NAME, noise=NOISE)
    like = p.data.experiments[0]
    there = replace(
        planned_data(p.data, planned),
        experiments=(prepare(p.data.bare, made, like.outputs, like.processing),),
    )
    costs = [
        fit(problem_on(there, h), None, lambda: False, ITERATIONS).cost for h in (p.first, p.second)
    ]
    assert costs[1] - costs[0] == pytest.approx(best.score, rel=LINEAR)
    assert costs[1] - costs[0] > TIE


def test_slow_and_fast_together_part_an_offset_from_asymmetric_friction() -> None:
    """While a joint keeps its speed both are a constant torque."""
    p = pair("nonlinear", "torque_offset", {"to1": 0.4, "to2": 0.2}, "friction_asymmetry",
             hold=0.25, amplitude=0.2, seconds=0.6)  # fmt: skip
    steady, lively = spec(hold=0.25, amplitude=0.1), spec(hold=0.02, amplitude=0.6)
    found = next_experiments(p.data, p.first, p.second, ("a", "b"), (steady, lively))
    assert found[0].simulate["amplitude"] == 0.6
    assert found[0].score > TIE


def test_planned_experiments_vary_posture_amplitude_and_pace() -> None:
    planned = possible_experiments(lags().data)
    assert len({(s.theta2, s.amplitude, s.hold) for s in planned}) == len(planned) == 12
    assert {s.sample_time for s in planned} == {1e-3}


def test_stopping_keeps_what_was_looked_at() -> None:
    p = lags()
    found = next_experiments(p.data, p.first, p.second, ("a", "b"), (spec(), spec()), lambda: True)
    assert found == ()
