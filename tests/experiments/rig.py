"""A rig with two recordings, and the machine behind it that plays what is planned."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from flexgui.core.experiments.design import Candidate, Design, ExperimentRequest, design
from flexgui.core.experiments.plan import fit_for_planning
from flexgui.core.loading import load_recordings
from flexgui.core.progress import Silent
from flexgui.core.recording.recording import Recording
from flexgui.core.scenario.read import parse_scenario
from flexgui.core.scenario.schema import Scenario
from flexgui.core.scenario.stated_effects import base_model
from flexgui.core.sensors import sensor
from flexgui.core.simulate.nonlinear import simulate_within

NOISE = {"z": 3e-5, "encoder": 1e-5, "deflection": 2e-5}
"""m and rad"""

TEXT = """
title = "x"
[arm]
preset = "paper"
[drive]
{drive}
[identify]
parameters = ["EI1", "EI2"]
start = {{ EI1 = 400.0, EI2 = 680.0 }}
{limits}
[[recordings]]
simulate = {{ theta2 = 1.2, seconds = 1.0{how} }}
[[recordings]]
simulate = {{ theta2 = 2.2, seconds = 1.0, seed = 2{how} }}
[sensors]
camera_noise = 3e-5
encoder_noise = 1e-5
deflection_noise = 2e-5
"""

BRIEF = ExperimentRequest(seconds=3.0)

LOOP = 'kind = "velocity_loop"\ngains = [60.0, 30.0]'
TORQUE = 'kind = "torque"'


HIDDEN = ", hidden = { coulomb_friction = { fc1 = 0.2, fc2 = 0.1 } }"
"""N m"""


def scenario(limits: str = "", drive: str = LOOP, hidden: bool = False) -> Scenario:
    how = "" if drive == LOOP else ", amplitude = 2.0"
    how += HIDDEN if hidden else ""
    return parse_scenario(TEXT.format(drive=drive, limits=limits, how=how), "x")


@cache
def recordings(drive: str = LOOP, hidden: bool = False) -> tuple[Recording, ...]:
    asked = scenario(drive=drive, hidden=hidden)
    return tuple(load_recordings(asked, base_model(asked), Path(), None, Silent()))


@cache
def planned(wish: ExperimentRequest = BRIEF, drive: str = LOOP, hidden: bool = False) -> Design:
    begun = fit_for_planning(scenario(drive=drive), recordings(drive, hidden), Silent())
    return design(begun, wish, Silent())


def recorded(c: Candidate, drive: str = LOOP, seed: int = 1) -> Recording:
    """What the machine's sensors read where an experiment is played to it."""
    machine = base_model(scenario(drive=drive)).at_level("nonlinear")
    task, point = c.trial.task(machine)
    motion = simulate_within(machine, machine.numbers(), task).trajectory
    rng = np.random.default_rng(seed)
    names = machine.drive.reference_channels(machine.arm)
    channels = {n: task.references[:, k] for k, n in enumerate(names)}
    for kind, noise in NOISE.items():
        y = np.array(sensor(kind).measure(motion))
        y += noise * rng.standard_normal(y.shape)
        channels |= {s.name: y[:, k] for k, s in enumerate(sensor(kind).channels(machine.arm))}
    return Recording("planned", task.time, channels, theta2=point)
