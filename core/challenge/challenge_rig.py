"""The rig of the challenges: the paper's arm in its velocity loop, with encoders and camera."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from ..arm.presets import presets
from ..drives.velocity_loop import VelocityLoop
from ..effects.effect import Rig
from ..model import Model
from ..noise.sensor_noise import autoregressive_noise
from ..recording.recording import Recording
from ..recording.spec import SimulateSpec
from ..scenario.schema import IdentifySpec
from ..sensors import sensor
from ..simulate.batch import run
from ..simulate.experiment import make_task
from ..simulate.linear import respond
from ..simulate.motion import Task
from ..simulate.nonlinear import simulate_within
from ..trajectory import Trajectory

GAINS = (60.0, 30.0)
"""N m s/rad, design section 2."""

STDS = {"z1": 3e-5, "z2": 3e-5, "theta1": 1e-5, "theta2": 1e-5}
"""channel -> standard deviation of its noise, m and rad."""

KINDS = ("z", "encoder")
CHANNELS = tuple(STDS)

IDENTIFY = IdentifySpec(parameters=("EI",), output=("z",))
"""The nominal parameter; a diagnosis adds the starts of each recording."""

STEPS = 8
"""Steps per sample to find an effect's size; more for effects with edges."""


@cache
def bare_model(level: str = "nonlinear", modes: int = 1) -> Model:
    """The paper's arm with nothing hidden."""
    arm = presets()["paper"]
    segments = tuple(s.model_copy(update={"modes": modes}) for s in arm.segments)
    return Model(arm.model_copy(update={"segments": segments}), VelocityLoop(gains=GAINS), level)


def challenge_rig(model: Model) -> Rig:
    """What the recordings of a challenge can show of a model."""
    return Rig(model.arm, model.drive, model.level, KINDS)


@dataclass(frozen=True)
class Experiment:
    """The references of one recording."""

    name: str
    spec: SimulateSpec

    def task(self, model: Model) -> Task:
        """The simulation task of a model."""
        return make_task(model, self.spec, self.name)[0]


def readings(model: Model, motion: Trajectory) -> np.ndarray:
    """(N, 4): what camera and encoders read along a motion, without noise, as CHANNELS."""
    dt = float(motion.time[1] - motion.time[0])
    return np.hstack([model.sensed(k, np.array(sensor(k).measure(motion)), dt, {}) for k in KINDS])


def simulate_roughly(model: Model, task: Task) -> Trajectory:
    """The motion with a fixed number of steps, or by the linear model."""
    numbers = model.numbers()
    if model.level == "lpv":
        return respond(model, [numbers], [task])[0]
    return run(model, numbers, task, model.steps(task.sample_time, STEPS))


def simulate_exactly(model: Model, task: Task) -> Trajectory:
    """The motion with a controlled error, for a recording."""
    if model.level == "lpv":
        return simulate_roughly(model, task)
    return simulate_within(model, model.numbers(), task).trajectory


def recording(
    experiment: Experiment, task: Task, model: Model, clean: np.ndarray, role: str = "estimate"
) -> Recording:
    """A recording of the channels CHANNELS, `clean` (N, 4), and of the references."""
    names = model.drive.reference_channels(model.arm)
    channels = {name: task.references[:, k] for k, name in enumerate(names)}
    channels |= {name: clean[:, k] for k, name in enumerate(CHANNELS)}
    moving = experiment.spec.sweep is not None
    theta2 = None if moving else experiment.spec.theta2
    return Recording(experiment.name, task.time, channels, role, source="study", theta2=theta2)


def with_noise(
    recordings: Sequence[Recording], kind: str, seed: Sequence[int]
) -> tuple[list[Recording], float]:
    """The recordings with noise, and its mean square in units of the stated deviations."""
    rng = np.random.default_rng([*seed, sum(map(ord, kind))])
    recordings_noisy, squares = [], []
    for r in recordings:
        draws = {
            name: noise(rng, len(r.time), std, AR_COEFFICIENTS[kind], r.sample_time)
            for name, std in STDS.items()
        }
        recordings_noisy.append(_with(r, {name: r[name] + x for name, x in draws.items()}))
        squares += [np.mean((x / STDS[name]) ** 2) for name, x in draws.items()]
    return recordings_noisy, float(np.mean(squares))


def _with(r: Recording, channels: Mapping[str, np.ndarray]) -> Recording:
    both = {**r.channels, **channels}
    return Recording(r.name, r.time, both, r.role, source=r.source, theta2=r.theta2)


AR_COEFFICIENT = 0.9
"""Coefficient of the first-order autoregression at SAMPLE_TIME: noise with a memory of 10 ms."""

SAMPLE_TIME = 1e-3
"""s"""

AR_COEFFICIENTS = {"white": 0.0, "coloured": AR_COEFFICIENT}
"""kind of noise -> coefficient."""


def noise(
    rng: np.random.Generator, samples: int, std: float, coefficient: float, dt: float = SAMPLE_TIME
) -> np.ndarray:
    """(samples,) of x(t) = a x(t - dt) + e(t), `dt` in s, stationary from the first sample on.

    `coefficient` is a, the correlation over SAMPLE_TIME; `std` is the standard deviation of x
    whatever the colour, in its unit.
    """
    if not coefficient:
        return std * rng.standard_normal(samples)
    return std * autoregressive_noise(rng, samples, coefficient ** (dt / SAMPLE_TIME))
