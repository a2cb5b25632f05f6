"""The data that the comparisons share: the paper's arm at its seven working points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from core.arm.presets import presets
from core.drives import build_drive
from core.identify.population import PopulationCost
from core.identify.predictor import Predictor
from core.identify.prepared import Prepared, Processing, prepare
from core.identify.residuals import Residuals, channel_weights
from core.identify.unknowns import collect_unknowns
from core.model import Model
from core.recording.spec import SimulateSpec
from core.scenario.schema import IdentifySpec
from core.sensors import sensor
from core.simulate.experiment import simulate_recording

GAINS = [60.0, 30.0]
NAMES = ("epsilon", "d")
LOWER, UPPER = np.array([0.8e9, 0.04]), np.array([1.2e9, 0.06])
AWAY = np.array([1.1e9, 0.048])
"""Some vector that is not the truth, so that the cost is not zero."""
MEMBERS, GENERATIONS = 30, 60


@dataclass(frozen=True)
class Case:
    """Seven recordings, their cost over (epsilon, d)."""

    model: Model
    experiments: list[Prepared]
    cost: PopulationCost


@cache
def glocal_case(seconds: float) -> Case:
    """theta2 = pi/8 .. 7 pi/8, 1 kHz, the two velocities of the rigid arm, no noise."""
    drive = build_drive("velocity_loop", {"gains": GAINS})
    model = Model(presets()["paper"], drive, level="lpv")
    recordings = [
        simulate_recording(
            model,
            SimulateSpec(theta2=k * np.pi / 8.0, seconds=seconds, seed=k, level="lpv"),
            f"th{k}",
        )
        for k in range(1, 8)
    ]
    bounds = {n: (a, b) for n, a, b in zip(NAMES, LOWER.tolist(), UPPER.tolist(), strict=True)}
    unknowns = collect_unknowns(model, IdentifySpec(parameters=NAMES, bounds=bounds), recordings)
    experiments = [prepare(model, r, [sensor("ydot")], Processing()) for r in recordings]
    residuals = Residuals(Predictor(experiments, unknowns), channel_weights(experiments, {}))
    cost = residuals.population()
    assert cost is not None
    return Case(model, experiments, cost)


def population(members: int = MEMBERS) -> np.ndarray:
    """(members, 2), uniform in the bounds."""
    return np.random.default_rng(0).uniform(LOWER, UPPER, (members, len(LOWER)))
