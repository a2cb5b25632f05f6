"""How well the linear model follows the non-linear one under the paper's experiments.

Design section 2: two velocity loops with gains 60 and 30 N m s/rad, references of +-0.3 rad/s
held 20 ms, 3 s, one mode, no noise.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import spearmanr

from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.sensors import sensor
from flexgui.core.simulate.experiment import make_task
from flexgui.core.simulate.linear import respond
from flexgui.core.simulate.nonlinear import simulate_within
from tests.helpers import PAPER, fit_percent, looped
from tests.marks import long_except

WORKING_POINTS = (np.pi / 8, np.pi / 2, 7 * np.pi / 8)
LEAST_FIT = 99.5
"""Per cent, both channels together."""
LARGEST_EXCURSION = 0.05
"""rad, of theta2 from its working point."""


def fit_and_excursion(excitation: str, theta2: float, seed: int) -> tuple[float, float]:
    model, ydot = looped(PAPER), sensor("ydot")
    numbers = model.numbers()
    spec = SimulateSpec(theta2=theta2, excitation=excitation, seed=seed)
    task, _ = make_task(model, spec, "experiment")
    true = simulate_within(model, numbers, task).trajectory
    linear = respond(model, [numbers], [task])[0]
    excursion = float(np.abs(true.q[:, 1] - theta2).max())
    return fit_percent(ydot.measure(true), ydot.measure(linear)), excursion


@pytest.mark.parametrize("theta2", WORKING_POINTS)
@pytest.mark.parametrize("seeds", long_except((6,), (6, 50)))
def test_linear_model_fits_under_the_default_excitation(theta2: float, seeds: int) -> None:
    default = SimulateSpec().excitation
    found = [fit_and_excursion(default, theta2, seed) for seed in range(1, seeds + 1)]
    fits, excursions = zip(*found, strict=True)
    assert min(fits) >= LEAST_FIT
    assert max(excursions) < LARGEST_EXCURSION


def test_under_plain_prbs_the_fit_falls_with_the_excursion() -> None:
    found = [fit_and_excursion("prbs", np.pi / 2, seed) for seed in range(1, 13)]
    fits, excursions = zip(*found, strict=True)
    assert spearmanr(fits, excursions).statistic < -0.5
    assert max(excursions) > LARGEST_EXCURSION
    assert min(fits) < LEAST_FIT
