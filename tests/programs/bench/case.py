"""The data that the comparisons share: the paper's arm at its seven working points, and the same as
a rig would hand it over, seven tables of numbers and a plain scenario."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from flexgui.core.effects import catalogue
from flexgui.core.identify.population_cost import PopulationCost
from flexgui.core.identify.predictor import Predictor
from flexgui.core.identify.prepared_recording import Prepared, prepare
from flexgui.core.identify.processing import Processing
from flexgui.core.identify.residuals import Residuals, channel_weights
from flexgui.core.identify.unknowns import collect_unknowns
from flexgui.core.model import Model
from flexgui.core.recording.save import save_recording
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.scenario.schema import IdentifySpec
from flexgui.core.sensors import sensor
from flexgui.core.simulate.experiment import NoiseLevels, simulate_recording
from tests.helpers import LAMBDA, PAPER, looped, with_modes

GAINS = list(LAMBDA)
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
    model = looped(PAPER, level="lpv")
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


NOISE = NoiseLevels({"z": 3e-5, "encoder": 1e-5})
"""m of a good camera, rad of an encoder with 18 bit."""
CHANNELS = ("dtheta1_ref", "dtheta2_ref", "theta1", "theta2", "z1", "z2")
TRUTH = 1e9 * 0.05**4 / 12.0
"""N m^2, of both segments of the paper's arm."""
START_SHARES = (1.3, 0.7)
"""What the start is of the truth."""


def write(
    folder: Path,
    seconds: float,
    modes: int,
    recordings: int = 7,
    hidden: Mapping[str, float] | None = None,
    end: str = "",
) -> Path:
    """The tables at theta2 = pi/8 .. 7 pi/8 and a scenario that states no working point, no
    level and no more of the fit than `parameters`; returns the scenario's file.

    `modes` are those of each segment, `hidden` sizes of viscous friction, `end` the file's last
    lines. More than seven tables repeat the working points with other references.
    """
    model = looped(with_modes(modes, modes))
    if hidden is not None:
        model = model.with_effects([catalogue()["viscous_friction"]], dict(hidden))
    for k in range(1, recordings + 1):
        place = ((k - 1) % 7 + 1) * np.pi / 8.0
        spec = SimulateSpec(
            theta2=place, seconds=seconds, seed=k, excitation="prbs", level="nonlinear"
        )
        found = simulate_recording(model, spec, f"th{k}", noise=NOISE)
        table = replace(found, channels={name: found[name] for name in CHANNELS})
        save_recording(table, folder / f"th{k}.csv")
    files = "".join(f'[[recordings]]\nfile = "th{k}.csv"\n' for k in range(1, recordings + 1))
    starts = ", ".join(f"EI{k + 1} = {TRUTH * a:.6g}" for k, a in enumerate(START_SHARES))
    file = folder / "plain.toml"
    file.write_text(
        'title = "Tables of a rig"\n'
        f'[arm]\npreset = "paper"\nmodes = {modes}\n'
        f'[drive]\nkind = "velocity_loop"\ngains = {GAINS}\n'
        f'[identify]\nparameters = ["EI1", "EI2"]\nstart = {{ {starts} }}\n{files}{end}',
        encoding="utf-8",
    )
    return file
