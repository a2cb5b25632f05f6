"""Experiments in simulation: from a specification to a recording."""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arm.arm import Arm
from ..errors import InputError
from ..excitation import build_excitation
from ..model import Model
from ..recording.inputs import input_signals
from ..recording.recording import Recording
from ..recording.spec import SimulateSpec
from ..sensors import sensors
from ..sensors.rigid_rates import SINGULAR_MARGIN
from ..sensors.sensor import Sensor
from ..sentences import did_you_mean
from ..simulate.linear import respond
from ..simulate.motion import Task, at_rest
from ..simulate.nonlinear import DEFAULT_TOLERANCE, NOISE_SHARE, simulate_within
from ..trajectory import Trajectory
from ..validation import finite_number


@dataclass(frozen=True)
class NoiseLevels:
    """Standard deviations of white noise by output, and the camera's rate in Hz."""

    by_output: dict[str, float]
    camera_rate: float | None = None


NO_NOISE = NoiseLevels({})


def simulate_recording(
    model: Model,
    spec: SimulateSpec,
    name: str,
    role: str = "estimate",
    noise: NoiseLevels = NO_NOISE,
    references: np.ndarray | None = None,
    values: Mapping[str, float] | None = None,
    state: Mapping[str, float] | None = None,
) -> Recording:
    """A recording of the model's motion, as a rig would have written it.

    Noise of `spec.snr_db` is white with SNR = 10 log10(cov y / cov noise) per channel, added
    after sampling.

    Args:
        model: Its drive must state a control law.
        spec: The experiment.
        name: Of the recording.
        role: 'estimate' or 'validate'.
        noise: Of the sensors.
        references: (N, references of the drive), in SI units, instead of the excitation.
        values: Parameter -> value in SI units; the model's own where not named.
        state: Coordinate or rate -> where it begins, in SI units; at rest where not named.

    Raises:
        InputError: Where the drive or the experiment does not allow it.
    """
    if not model.drive.torque_known:
        raise InputError(
            f"Recording {name}: [drive] kind {model.drive.kind!r} needs recorded joints to follow; "
            f"simulate with the control loop of the rig, such as velocity_loop."
        )
    values = values or {}
    task, theta2 = make_task(model, spec, name, references, values)
    task = _begun_at(task, model.arm, state or {})
    numbers = model.numbers(values)
    remarks: tuple[str, ...] = ()
    if spec.level == "lpv":
        trajectory = respond(model, [numbers], [task])[0]
    else:
        result = simulate_within(model, numbers, task, simulation_tolerance(model.arm, noise))
        trajectory = result.trajectory
        remarks = (
            f"Simulated with the non-linear equations, {result.substeps} steps per sample. Shorter "
            f"steps would change positions by about {1e6 * result.error:.2g} µm and angles by "
            f"{1e6 * result.error:.2g} µrad.",
        )
    channels = read_sensors(model, trajectory, spec, noise, values)
    for k, channel in enumerate(model.drive.reference_channels(model.arm)):
        channels[channel] = task.references[:, k]
    return Recording(
        name=name, time=task.time, channels=channels, role=role, source="simulation",
        warnings=remarks, theta2=theta2,
    )  # fmt: skip


def _begun_at(task: Task, arm: Arm, state: Mapping[str, float]) -> Task:
    """The task with some of its initial coordinates and rates elsewhere."""
    names = [f"{rate}{q}" for rate in ("", "d") for q in arm.coordinate_names]
    start = task.start.copy()
    for name, value in state.items():
        if name not in names:
            hint = did_you_mean(name, names)
            raise InputError(f"state: {name!r} is no coordinate or rate of this arm; {hint}")
        start[names.index(name)] = finite_number(value, f"state: {name}")
    return replace(task, start=start)


def simulation_tolerance(arm: Arm, noise: NoiseLevels) -> float:
    """m or rad, rms: a share of the least noise of a place or an angle, where one is stated."""
    levels = [
        level
        for kind, level in noise.by_output.items()
        if level > 0.0 and {c.unit for c in sensors()[kind].channels(arm)} <= {"m", "rad"}
    ]
    return max(NOISE_SHARE * min(levels, default=0.0), DEFAULT_TOLERANCE)


def start_joints(model: Model, spec: SimulateSpec, name: str) -> np.ndarray:
    """(joints,) rad (m) where the experiment starts; InputError where its values are not one per
    joint."""
    joints = np.zeros(model.arm.joints)
    if spec.theta is not None:
        if len(spec.theta) != model.arm.joints:
            raise InputError(
                f"Recording {name}: simulate.theta has {len(spec.theta)} values; "
                f"the arm has {model.arm.joints} joints."
            )
        joints[:] = spec.theta
    if model.arm.joints > 1:
        if spec.theta2 is not None:
            joints[1] = spec.theta2
        if spec.sweep is not None:
            joints[1] = spec.sweep[0]
    return joints


def make_task(
    model: Model,
    spec: SimulateSpec,
    name: str,
    references: np.ndarray | None = None,
    values: Mapping[str, float] | None = None,
) -> tuple[Task, float | None]:
    """The references and the start of an experiment, and its working point theta2 if it has one.

    Arguments as those of `simulate_recording`, so references are (N, nr).
    """
    arm, values = model.arm, values or {}
    joints = start_joints(model, spec, name)
    channels = model.drive.reference_channels(arm)
    signal = _excited(model, spec, joints) if references is None else references
    time = np.arange(len(signal)) * spec.sample_time
    schedule = at_rest(joints, arm.coordinates)[None, : arm.coordinates]
    if spec.sweep is not None:
        signal, schedule = _add_sweep(signal, channels, spec, time, schedule, name)
    law = model.numbers(values).law
    start = at_rest(model.started(joints, values), arm.coordinates, law.states)
    schedule[:, : arm.joints] += start[: arm.joints] - joints
    moving = spec.sweep is not None
    theta2 = float(joints[1]) if arm.joints > 1 and not moving else None
    inputs = input_signals(model.inputs, time, {}, name)
    return Task(time, signal, start, schedule, inputs=inputs), theta2


def _excited(model: Model, spec: SimulateSpec, joints: np.ndarray) -> np.ndarray:
    """(N, references of the drive): the excitation of the experiment about `joints`."""
    nj = model.arm.joints
    options = {"amplitude": spec.amplitude, "hold": spec.hold, **spec.options}
    rng = np.random.default_rng([spec.seed, 0])
    excitation = build_excitation(spec.excitation, options)
    signal = excitation.signal(spec.samples, nj, spec.sample_time, rng)
    channels = model.drive.reference_channels(model.arm)
    # Known torques come after the references of the joints; nobody pulls here.
    signal = np.hstack([signal, np.zeros((spec.samples, max(len(channels) - nj, 0)))])
    for k, channel in enumerate(channels):
        if channel == f"theta{k + 1}_ref":
            signal[:, k] += joints[k]
    return signal


def _add_sweep(
    signal: np.ndarray,
    channels: Sequence[str],
    spec: SimulateSpec,
    time: np.ndarray,
    schedule: np.ndarray,
    name: str,
) -> tuple[np.ndarray, np.ndarray]:
    assert spec.sweep is not None
    if "dtheta2_ref" not in channels:
        raise InputError(
            f"Recording {name}: simulate.sweep needs velocity references; "
            f'use [drive] kind = "velocity_loop".'
        )
    start, stop = spec.sweep
    across = np.floor(start / np.pi) != np.floor(stop / np.pi)
    if across or min(abs(np.sin(start)), abs(np.sin(stop))) < np.sin(SINGULAR_MARGIN):
        raise InputError(
            f"Recording {name}: simulate.sweep reaches a stretched or folded arm, where y is "
            f"singular; stay {SINGULAR_MARGIN} rad away from 0 and pi."
        )
    rate = half_cosine_rate(start, stop, len(time), spec.sample_time)
    signal[:, channels.index("dtheta2_ref")] += rate
    path = np.repeat(schedule, len(time), axis=0)
    path[:, 1] = start + np.cumsum(rate) * spec.sample_time - rate * spec.sample_time
    return signal, path


def half_cosine_rate(start: float, stop: float, samples: int, dt: float) -> np.ndarray:
    """(samples,) rad/s of the smooth move start -> stop, in rad, over T = samples dt, `dt` in s:
    theta(t) = start + (stop - start) (1 - cos(pi t / T)) / 2."""
    T = samples * dt
    t = np.arange(samples) * dt + dt / 2.0  # the mean velocity over each held sample
    return (stop - start) * np.pi / (2.0 * T) * np.sin(np.pi * t / T)


def read_sensors(
    model: Model,
    trajectory: Trajectory,
    spec: SimulateSpec,
    noise: NoiseLevels,
    effect_values: Mapping[str, float] | None = None,
) -> dict[str, np.ndarray]:
    """All channels that the arm's sensors give, with their noise."""
    channels: dict[str, np.ndarray] = {}
    for kind, sensor in sorted(sensors().items()):
        if not sensor.defined_on(trajectory.arm):
            continue
        if sensor.optional and kind not in noise.by_output and not _mounted(sensor, trajectory.arm):
            continue
        values = np.array(sensor.measure(trajectory))
        values = np.array(model.sensed(kind, values, spec.sample_time, effect_values or {}))
        draws = noise_stream(spec.seed, kind).standard_normal(values.shape)
        values += draws * _deviation(sensor, values, spec, noise)
        if sensor.at_camera_rate and noise.camera_rate is not None:
            values = _sampled(values, spec.sample_time, noise.camera_rate)
        for k, channel in enumerate(sensor.channels(trajectory.arm)):
            channels[channel.name] = values[:, k]
    return channels


def _mounted(sensor: Sensor, arm: Arm) -> bool:
    """Whether a place is stated for one of its channels."""
    return any(channel.name in dict(arm.mounts) for channel in sensor.channels(arm))


def noise_stream(seed: int, kind: str) -> np.random.Generator:
    """The noise of one kind of sensor: another sensor beside it does not change it."""
    return np.random.default_rng([seed, 1, zlib.crc32(kind.encode())])


def _deviation(
    sensor: Sensor, values: np.ndarray, spec: SimulateSpec, noise: NoiseLevels
) -> np.ndarray:
    """(k,) standard deviations of the noise of one sensor's channels."""
    stated = noise.by_output.get(sensor.kind, 0.0)
    if spec.snr_db is None or not sensor.from_camera:
        return np.full(values.shape[1], stated)
    ratio = 10.0 ** (-spec.snr_db / 20.0)
    return np.asarray(np.hypot(values.std(axis=0) * ratio, stated))


def _sampled(values: np.ndarray, dt: float, rate: float) -> np.ndarray:
    """Keeps the samples of a slower camera; the rest are empty."""
    stride = max(int(round(1.0 / (rate * dt))), 1)
    out = np.full_like(values, np.nan)
    out[::stride] = values[::stride]
    return out
