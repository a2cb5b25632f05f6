"""Noise floors of rigs driven by torque hang on the draws of the noise by little."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexgui.core.diagnose.diagnose import fit_base_to_recordings
from flexgui.core.diagnose.noise_update import LEAST_RATIO
from flexgui.core.diagnose.search_options import Options
from flexgui.core.noise import noise_propagation
from flexgui.core.noise.noise_floor import UNCERTAINTY
from flexgui.core.noise.output_noise import output_noise
from flexgui.core.progress import Silent
from flexgui.core.scenario.read import read_scenario
from tests.diagnose.fits import set_up
from tests.programs.sample.cases import TORQUE
from tests.programs.sample.torque_rigs import written

RIGS = (
    "rigid_two_nothing",
    "rigid_one_viscous_coulomb",
    "slide_nothing",
    "flexible_one_nothing",
    "flexible_two_payload",
)
SEEDS = 20

ALIKE = 0.9
"""Share of all floors that differ from their median by less than what makes anything be weighed
again: a level of six draws of a noise that shakes links scatters by about a tenth."""


@pytest.mark.long
@pytest.mark.parametrize("name", RIGS)
def test_a_floor_is_the_same_whatever_the_draws(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = read_scenario(written(TORQUE[name], 100, tmp_path))
    setup, recordings = set_up(scenario, tmp_path)
    begun = fit_base_to_recordings(setup, scenario.identify, recordings, Options(), Silent())
    h = begun.base.parametrised
    experiments, motions = h.residuals.experiments, h.motions()
    floors = []
    for seed in range(SEEDS):
        monkeypatch.setattr(noise_propagation, "SEED", seed)
        found = output_noise(experiments, motions, {})
        floors.append([found[channel].level for channel, _ in experiments[0].channels])
    ratios = np.array(floors) / np.median(floors, axis=0)
    scatter = np.exp(np.abs(np.log(ratios)))
    assert np.mean(scatter < LEAST_RATIO) > ALIKE
    assert scatter.max() < UNCERTAINTY, "the factor within which a floor is said to be known"
