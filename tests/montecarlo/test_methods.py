"""The parts of the baselines and of the advice, each against what is known."""

from __future__ import annotations

import numpy as np
import pytest

from flexgui.core.montecarlo.interpolated import (
    StateSpace,
    identify_interpolated,
    identify_subspace,
)
from flexgui.core.montecarlo.parts.advice import relative_normal_equations
from flexgui.core.montecarlo.parts.baselines import BlackBox, pole_error, references
from flexgui.core.montecarlo.parts.fits import fit, run_data
from flexgui.core.montecarlo.rig import Rig, fit_percent, noise_std, outputs
from flexgui.core.scenario.schema import IdentifySpec
from flexgui.core.simulate.posture import integrators, posture
from tests.montecarlo.helpers import short

EXACT = 1e-6
"""Noise-free data of a system of that order: rounding, enlarged by the Hankel matrices."""
NEAR = 0.02
"""Relative: poles of the arm from noise-free data, which are non-linear."""
RATIO = 0.1
"""Relative error of a standard deviation over 60 fits, which is 9 %, and a little more."""
REPEATS = 60


def system(rng: np.random.Generator) -> StateSpace:
    """Four stable states, two inputs, two outputs."""
    A = np.diag([0.9, 0.7, 0.0, 0.0])
    A[2:, 2:] = 0.95 * np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
    return StateSpace(A, rng.standard_normal((4, 2)), rng.standard_normal((2, 4)))


def test_subspace_finds_a_system_from_its_noise_free_response() -> None:
    rng = np.random.default_rng(1)
    true, u = system(rng), rng.standard_normal((2000, 2))
    found = identify_subspace(u, true.respond(u), [4])[0]
    fresh = rng.standard_normal((200, 2))
    assert np.allclose(found.respond(fresh), true.respond(fresh), atol=EXACT)
    assert pole_error(np.linalg.eigvals(found.A), np.linalg.eigvals(true.A)) < EXACT


@pytest.mark.long
def test_subspace_is_consistent_in_noise() -> None:
    rng = np.random.default_rng(2)
    true = system(rng)
    errors = []
    for samples in (1000, 16000):
        u = rng.standard_normal((samples, 2))
        y = true.respond(u)
        found = identify_subspace(u, y + 0.5 * y.std() * rng.standard_normal(y.shape), [4])[0]
        errors.append(pole_error(np.linalg.eigvals(found.A), np.linalg.eigvals(true.A)))
    assert errors[1] < 0.5 * errors[0]


def test_other_coordinates_change_no_response() -> None:
    rng = np.random.default_rng(3)
    true, u = system(rng), rng.standard_normal((100, 2))
    assert np.allclose(true.transformed(rng.standard_normal((4, 4))).respond(u), true.respond(u))


def test_poles_that_are_missing_count_as_wrong() -> None:
    true = np.array([-10.0 + 5.0j, -10.0 - 5.0j, -100.0])
    assert pole_error(true, true) == 0.0
    assert pole_error(true[:2], true) == pytest.approx(1.0 / 3.0)


@pytest.mark.long
def test_the_arms_poles_are_found_by_one_local_black_box() -> None:
    rig = Rig(short())
    experiment = rig.settings.experiments[1].simulate
    assert experiment is not None
    recording = rig.recording(experiment.model_copy(update={"seconds": 3.0}), "long")
    model = identify_subspace(references(recording), outputs(recording), [6])[0]
    found = np.log(np.linalg.eigvals(model.A).astype(complex)) / recording.sample_time
    true = posture(rig.model, np.array([0.0, float(recording.theta2 or 0.0)])).poles
    assert pole_error(found, true[~integrators(true)]) < NEAR


@pytest.mark.long
def test_an_interpolated_black_box_follows_the_arm_at_its_points() -> None:
    rig = Rig(short(points=5))
    recordings = [
        rig.recording(e.simulate.model_copy(update={"seconds": 3.0}), e.name)
        for e in rig.settings.experiments
        if e.simulate
    ]
    pairs = [(references(r), outputs(r)) for r in recordings]
    points = [float(r.theta2 or 0.0) for r in recordings]
    box = BlackBox(identify_interpolated(pairs, points, 6), recordings[0].sample_time)
    assert box.parameters > 100
    assert np.mean([fit_percent(outputs(r), box.predict(r)) for r in recordings]) > 90.0


def test_fisher_information_predicts_the_deviation_that_fits_have() -> None:
    rig = Rig(short(points=2))
    spec = IdentifySpec(parameters=("EI",), output=("ydot",), generations=0)
    found = [fit(rig, "EI", run_data(rig, 20.0, run), spec) for run in range(REPEATS)]
    std = np.std([f.fit.estimates[0].value for f in found], ddof=1) / rig.stiffness({})[0]
    total, meat = np.zeros((2, 2)), np.zeros((2, 2))
    for r in rig.experiments():
        told = np.array(relative_normal_equations(rig, r)["information"])
        total += told.sum(axis=0)
        meat += np.tensordot(noise_std(outputs(r), 20.0) ** 2, told, axes=1)
    # Along (1, 4): EI = epsilon d^4 / 12. In epsilon alone the information is that of EI.
    predicted = np.sqrt(meat[0, 0]) / total[0, 0]
    assert std == pytest.approx(predicted, rel=3.0 * RATIO)
