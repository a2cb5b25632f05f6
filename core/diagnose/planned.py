"""Experiments that were not made yet: which there could be, and a recording's shape for them."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np

from core.diagnose.data import Data
from core.identify.prepared import prepare
from core.identify.unknowns import Unknown
from core.model import Model
from core.recording.recording import Recording
from core.recording.spec import SimulateSpec
from core.simulate.experiment import NO_NOISE, make_task, read_sensors, start_joints
from core.simulate.motion import Task
from core.trajectory import Trajectory

NAME = "planned"

POINTS = (np.pi / 4.0, np.pi / 2.0, 3.0 * np.pi / 4.0)
"""rad, working points of an arm with an elbow."""

STRONGER = (1.0, 2.0)
"""Times the amplitude of the recordings there are."""

HOLDS = (0.02, 0.1)
"""s: a fast excitation, and one with stretches of steady motion."""

LONGEST = 3.0
"""s: as long as the recordings there are, but no longer."""


def possible(data: Data) -> tuple[SimulateSpec, ...]:
    """Variations of what was recorded: posture, amplitude, pace.

    None where a servo replays recorded torques: nobody knows what a new torque would be.
    """
    if data.bare.steering is not None:
        return ()
    recording = data.experiments[0].recording
    seconds = min(LONGEST, len(recording.time) * recording.sample_time)
    elbow = data.bare.arm.joints > 1
    size = _amplitude(data.bare, recording)
    dt = recording.sample_time
    return tuple(
        SimulateSpec(
            theta2=float(point) if elbow else None, amplitude=float(factor * size), hold=hold,
            seconds=float(round(seconds / dt) * dt), sample_time=float(dt),
        )
        for point, factor, hold in product(POINTS if elbow else (0.0,), STRONGER, HOLDS)
    )  # fmt: skip


def _amplitude(model: Model, recording: Recording) -> float:
    """Half the range of the references there were."""
    names = model.drive.reference_channels(model.arm)
    return max(float(np.ptp(recording[name])) / 2.0 for name in names) or 1.0


def planned_data(data: Data, spec: SimulateSpec) -> Data:
    """The data of an experiment to come: nothing is measured, everything counts."""
    return data_of(data, _recording(data.bare, spec, data.experiments[0].recording))


def data_of(data: Data, recording: Recording) -> Data:
    """The data of a recording that stands for an experiment to come."""
    like = data.experiments[0]
    prepared = prepare(data.bare, recording, like.outputs, like.processing)
    weights = np.array([1.0 / data.floors[name] for name, _ in prepared.channels])
    shared = [u for u in data.nuisance if u.recording is None]
    own = {u.parameter.name: u for u in data.nuisance if u.recording is not None}
    nuisance = (*shared, *[Unknown(u.parameter, NAME, u.searched) for u in own.values()])
    # Nothing takes the error of few steps off here, so there are as many as a statement needs.
    return replace(
        data,
        steps=data.fine,
        experiments=(prepared,),
        weights=(weights,),
        nuisance=nuisance,
        anchor=None,
    )


def _recording(model: Model, spec: SimulateSpec, like: Recording) -> Recording:
    """The channels that the recordings there are have, as often sampled; zero but for the
    references and the joints' start."""
    task, theta2 = make_task(model, spec, NAME)
    N = len(task.time)
    channels = {name: _blank(values, N) for name, values in like.channels.items()}
    for k, name in enumerate(model.drive.reference_channels(model.arm)):
        channels[name] = task.references[:, k]
    for k, place in enumerate(start_joints(model, spec, NAME)):
        if f"theta{k + 1}" in channels:
            channels[f"theta{k + 1}"] = np.full(N, place)
    return Recording(NAME, task.time, channels, theta2=theta2)


def expected_recording(
    model: Model, task: Task, theta2: float | None, motion: Trajectory, like: Recording
) -> Recording:
    """What the sensors of the recordings there are would read along a motion, as often sampled."""
    N, spec = len(task.time), SimulateSpec(sample_time=task.sample_time)
    read = read_sensors(model, motion, spec, NO_NOISE)
    channels = {n: _blank(values, N) + read.get(n, 0.0) for n, values in like.channels.items()}
    for k, name in enumerate(model.drive.reference_channels(model.arm)):
        channels[name] = task.references[:, k]
    return Recording(NAME, task.time, channels, theta2=theta2)


def _blank(values: np.ndarray, N: int) -> np.ndarray:
    """Zeros (N,), NaN between the samples of a slower sensor."""
    index = np.flatnonzero(np.isfinite(values))
    stride = max(int(np.median(np.diff(index))), 1) if index.size > 1 else 1
    return np.where(np.arange(N) % stride == 0, 0.0, np.nan)
