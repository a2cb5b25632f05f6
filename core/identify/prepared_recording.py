"""A recording prepared for a model: simulation task, compared outputs, processing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..arm.arm import Structure
from ..drives.law import DriveLaw
from ..drives.servo import Recorded, rates_along
from ..errors import InputError
from ..identify.first_states import START, bent_by_weight, followed_first_state, start_joints
from ..identify.prescribed_joint_forces import simulated_part
from ..identify.prescribed_joint_motion import unknown_ends
from ..identify.prescribed_joints import is_prescribed
from ..identify.processing import TORQUE, Processing, delayed
from ..identify.standstill import Standstill
from ..identify.unknowns import GAIN, OFFSET
from ..model import Model, Numbers
from ..recording.channels import from_camera
from ..recording.initial_motion import AT_ONCE
from ..recording.inputs import input_signals
from ..recording.recording import Beginning, Recording, apply_logger_filter
from ..sensors.sensor import Sensor
from ..simulate.motion import Task, at_rest
from ..trajectory import Trajectory


@dataclass(frozen=True)
class Prepared:
    """One recording, one model, the outputs that are compared."""

    model: Model
    recording: Recording
    outputs: tuple[Sensor, ...]
    processing: Processing
    task: Task
    measured: np.ndarray
    """(M, k), processed; NaN where there is no sample."""
    counted: np.ndarray
    """(M, k) bool"""
    standstill: Standstill
    """Of the recording; the same for every model with the same drive."""

    @property
    def channels(self) -> tuple[tuple[str, str], ...]:
        """(name, unit) of the k outputs."""
        each = (c for s in self.outputs for c in s.channels(self.model.arm))
        return tuple((c.name, c.unit) for c in each)

    @cached_property
    def kinds(self) -> tuple[str, ...]:
        """Of the sensors of the k channels."""
        return tuple(s.kind for s in self.outputs for _ in s.channels(self.model.arm))

    @property
    def time(self) -> np.ndarray:
        """(M,) instants of the compared samples, s."""
        return self.task.time[:: self.processing.decimate]

    def task_at(self, values: Mapping[str, float]) -> Task:
        """The task with the initial deviations that the values state."""
        moved = [name for name in values if name.startswith(START)]
        joints = self.model.arm.joints
        true = self.model.started(self.task.start[:joints], values)
        shifted, bent = true - self.task.start[:joints], np.zeros(0)
        if self.recording.beginning is not Beginning.REST:
            bent = bent_by_weight(self.model, true, values)
        task = self._followed_at(values)
        if not moved and not np.any(shifted) and task is self.task and not bent.any():
            return self.task
        start, schedule, names = task.start.copy(), task.schedule, self.model.arm.coordinate_names
        if task is self.task:
            start[:joints] += shifted
        start[joints : joints + len(bent)] = bent
        if np.any(shifted):
            schedule = schedule + np.pad(shifted, (0, len(names) - joints))
        for first, prefix in ((0, START), (len(names), f"{START}d")) if moved else ():
            free = {name for name in names if prefix + name in values}
            own = np.array([values.get(prefix + name, 0.0) for name in names])
            start[first : first + len(names)] += followed_first_state(self.model, free, own)
        # Where the first state is estimated, rest is one value of it and no other way to begin.
        return replace(task, start=start, schedule=schedule, before=None if moved else task.before)

    def _followed_at(self, values: Mapping[str, float]) -> Task:
        """The task with the motion that the virtual servo follows at these values."""
        if self.model.steering is None:
            return self.task
        whole, measured = self._place_at(values)
        if whole is measured:
            return self.task
        joints, n = self.model.arm.joints, self.model.arm.coordinates
        N = len(self.task.time)
        place, at_rest = whole[-N:], self.task.before is not None
        speed = rates_along(place, self.recording.sample_time, at_rest)
        references, start = self.task.references.copy(), self.task.start.copy()
        references[:, -2 * joints :] = np.hstack([place, speed])
        start[:joints], start[n : n + joints] = place[0], speed[0]
        before = None if self.task.before is None else whole[:-N]
        return replace(self.task, references=references, start=start, before=before)

    def _place_at(self, values: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
        """Joint positions (L + N, joints) at these values, before and in the recording, and the
        encoders' readings; the same array if equal."""
        joints, before = self.model.arm.joints, self.task.before
        measured = self.task.references[:, -2 * joints : -joints]
        measured = measured if before is None else np.vstack([before, measured])
        return self.model.followed(measured, self.recording.sample_time, values), measured

    def predicted(
        self, trajectory: Trajectory, numbers: Numbers, values: Mapping[str, float]
    ) -> np.ndarray:
        """(M, k): the model's outputs, processed like the measured ones."""
        return self.processed(self.readings(trajectory, numbers, values))

    def readings(
        self, trajectory: Trajectory, numbers: Numbers, values: Mapping[str, float]
    ) -> np.ndarray:
        """(N, k): the model's readings before the filters of the comparison."""
        if not np.all(np.isfinite(trajectory.q)):  # a simulation that diverged
            return np.full((len(self.task.time), len(self.channels)), np.nan)
        columns = [self.sensed(sensor, trajectory, numbers, values) for sensor in self.outputs]
        raw = np.hstack(columns)
        for k, (name, _) in enumerate(self.channels):
            raw[:, k] = self.through_logger(name, raw[:, k])
            raw[:, k] = values.get(GAIN + name, 1.0) * raw[:, k] + values.get(OFFSET + name, 0.0)
        return raw

    def processed(self, raw: np.ndarray) -> np.ndarray:
        """(M, k, ...): `raw` readings (N, k, ...) behind the filters of the comparison."""
        return self.processing.apply(raw, self.recording.sample_time, self.kinds)

    def processed_change(self, raw: np.ndarray) -> np.ndarray:
        """(M, k): processed change `raw` (N, k) of the readings, as filters are linear; unchanged
        channels cost nothing."""
        change = np.zeros((len(self.time), raw.shape[1]))
        changed = np.any(raw != 0.0, axis=0)
        if changed.any():
            kinds = [
                kind for kind, is_changed in zip(self.kinds, changed, strict=True) if is_changed
            ]
            dt = self.recording.sample_time
            change[:, changed] = self.processing.apply(raw[:, changed], dt, kinds)
        return change

    def sensed(
        self, sensor: Sensor, trajectory: Trajectory, numbers: Numbers, values: Mapping[str, float]
    ) -> np.ndarray:
        """(N, k): a sensor's reading along a motion, before any filter; of a virtual servo's
        torque, the reading of the drive's sensor by the model."""
        y = np.array(sensor.measure_like(self.recording, trajectory))
        y = self.sensed_by(sensor.kind, y, values)
        steering = self.model.steering
        if sensor.kind != TORQUE or steering is None:
            return y
        # What the servo adds is the residual, whatever torque constant is being tried.
        arm, dt = self.model.arm, self.recording.sample_time
        law = steering.base.law(arm, trajectory.p, {**self.model.effect_values, **values})
        as_stated, stated = self._stated
        same = as_stated.same_gains(law)
        if is_prescribed(self.model, simulated_part(self.model, numbers)):
            recorded = self._recorded_around
            applied = self._stated_around if same else steering.recorded_torque(recorded, arm, law)
            missing = steering.response(_with_ends(y - applied, *self._vague_ends), dt)
        else:
            applied = stated if same else steering.recorded_torque(self._recorded, arm, law)
            place = self._place_at(values)[0][-len(y) :]
            missing = y + steering.between_samples(place, dt) - applied
        return stated + (missing if same else _in_stated_units(missing, applied, stated))

    def sensed_by(self, kind: str, y: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
        """(N, k): what a kind of sensor reads of y (N, k); values may hold a first state."""
        moving = any(name.startswith(f"{START}d") for name in values)
        return self.model.sensed(kind, y, self.recording.sample_time, values, moving)

    @cached_property
    def _stated(self) -> tuple[DriveLaw, np.ndarray]:
        """The drive as stated, and the torque (N, joints) that it applied then."""
        steering, arm = self.model.servo, self.model.arm
        law = steering.base.law(arm, self.model.numbers().p, {})
        return law, steering.recorded_torque(self._recorded, arm, law)

    @cached_property
    def _recorded(self) -> Recorded:
        """Of the rig that the virtual servo follows."""
        return self.model.servo.recorded(self.recording, self.model.arm)

    @cached_property
    def _recorded_around(self) -> Recorded:
        """The same, averaged around each sample."""
        return self.model.servo.recorded_around(self.recording, self.model.arm)

    @cached_property
    def _stated_around(self) -> np.ndarray:
        """(N, joints): the torque that the drive as stated applied, averaged around each sample."""
        recorded, arm = self._recorded_around, self.model.arm
        return self.model.servo.recorded_torque(recorded, arm, self._stated[0])

    @cached_property
    def _vague_ends(self) -> tuple[int, int]:
        """Samples at both ends at which the torque along prescribed joints is unknown."""
        return unknown_ends(self.model, self.task)

    def through_logger(self, name: str, y: np.ndarray) -> np.ndarray:
        """y (N, ...) of one channel as the logger writes it: delayed with the camera, and
        filtered."""
        delay = self.recording.camera.delay
        if delay and from_camera(name):
            y = delayed(y, self.task.time, delay)
        logged = self.recording.logger_filters.get(name)
        return y if logged is None else apply_logger_filter(y, self.recording.sample_time, logged)


def _with_ends(x: np.ndarray, first: int, last: int) -> np.ndarray:
    """(N, k) with so many samples at both ends replaced by the mean of their neighbours: filters
    continue from an end, and a mean has little noise."""
    if len(x) <= first + last:
        return x
    x[:first] = x[first : first + AT_ONCE].mean(axis=0)
    x[-last:] = x[-last - AT_ONCE : -last].mean(axis=0)
    return x


def _in_stated_units(missing: np.ndarray, applied: np.ndarray, stated: np.ndarray) -> np.ndarray:
    """(N, joints) missing torque in units of the recorded signal at the stated gains. Sensors err
    in the recorded signal: with a smaller torque constant every error would shrink."""
    sizes = np.sqrt(np.mean(applied**2, axis=0)), np.sqrt(np.mean(stated**2, axis=0))
    nonzero = (sizes[0] > 0.0) & (sizes[1] > 0.0)
    return missing * np.divide(sizes[1], sizes[0], out=np.ones(len(nonzero)), where=nonzero)


def prepare(
    model: Model, recording: Recording, outputs: Sequence[Sensor], processing: Processing
) -> Prepared:
    """InputError where the recording lacks something that model or outputs need."""
    arm = model.arm
    measured, counted = [], []
    for sensor in outputs:
        y, mask = measured_outputs(model, recording, sensor)
        measured.append(y)
        counted.append(mask)
    dt = recording.sample_time
    raw = np.hstack(measured) if measured else np.zeros((len(recording.time), 0))
    mask = np.hstack(counted) if counted else np.zeros((len(recording.time), 0), dtype=bool)
    kinds = tuple(s.kind for s in outputs for _ in s.channels(arm))
    processed = processing.apply(raw, dt, kinds)
    if model.steering is not None and kinds:
        mask = mask & np.column_stack([processing.inside(k, len(mask), dt) for k in kinds])
    counts = mask[:: processing.decimate] & np.isfinite(processed)
    task = make_task(model, recording)
    if outputs and not counts.any():
        raise InputError(
            f"Recording {recording.name}: no sample of its outputs counts; check mask, window "
            f"and [identify] filter."
        )
    still = Standstill(model.steering, recording, processing, kinds, counts)
    return Prepared(model, recording, tuple(outputs), processing, task, processed, counts, still)


def for_model(experiment: Prepared, model: Model) -> Prepared:
    """The recording, prepared for another model."""
    before = experiment.model
    if before is model:
        return experiment
    if before.steering != model.steering:
        return prepare(model, experiment.recording, experiment.outputs, experiment.processing)
    same = before.active_steering is model.active_steering and _driven(before) == _driven(model)
    task = experiment.task if same else make_task(model, experiment.recording)
    return replace(experiment, model=model, task=task)


def _driven(model: Model) -> tuple[object, ...]:
    """What the task of a recording depends on, beside what moves the joints."""
    arm = model.arm
    return Structure.of(arm), tuple(arm.gravity), model.numbers().law.states, model.inputs


def can_measure(model: Model, recording: Recording, sensor: Sensor) -> bool:
    """Whether a recording has samples of an output; a virtual servo gives the torque wherever the
    drive does."""
    if model.steering is not None and model.drive.torque_known and sensor.kind == TORQUE:
        return True
    arm = model.arm
    return sensor.available(recording, arm) and bool(
        np.isfinite(sensor.measured(recording, arm)).any()
    )


def measured_outputs(
    model: Model, recording: Recording, sensor: Sensor
) -> tuple[np.ndarray, np.ndarray]:
    """Measured (N, k) and which samples count (N, k): none of what the recording lacks."""
    arm = model.arm
    names = [c.name for c in sensor.channels(arm)]
    steering = model.steering
    if sensor.kind == TORQUE and steering is not None:
        recorded = steering.recorded(recording, arm)
        y = steering.recorded_torque(recorded, arm, steering.base.law(arm, model.numbers().p, {}))
    elif sensor.available(recording, arm):
        sensor.check(arm, recording)
        y = np.array(sensor.measured(recording, arm))
    else:
        y = np.full((len(recording.time), len(names)), np.nan)
    mask = np.isfinite(y)
    for k, name in enumerate(names):
        chosen = recording.counted.get(name)
        if chosen is not None:
            mask[:, k] &= chosen
    if sensor.kind == TORQUE:
        mask[:, [k - 1 for k in model.drive.torque_unknown]] = False
    return y, mask


def make_task(model: Model, recording: Recording) -> Task:
    """References, start and schedule of a recording."""
    arm, steering = model.arm, model.steering
    references = model.active_steering.signals(recording, arm)
    states = model.numbers().law.states
    start = at_rest(start_joints(model, recording), arm.coordinates, states)
    before = None
    if steering is not None:
        motion = steering.motion(recording, arm)
        before = motion.before
        start[: arm.joints] = motion.place[0]
        start[arm.coordinates : arm.coordinates + arm.joints] = motion.speed[0]
    inputs = input_signals(model.inputs, recording.time, recording.channels, recording.name)
    return Task(recording.time, references, start, joint_schedule(model, recording), before, inputs)


def joint_schedule(model: Model, recording: Recording) -> np.ndarray:
    """(1, n) at a working point; (N, n) with the joints as measured where none is stated."""
    arm = model.arm
    n = arm.coordinates
    point = start_joints(model, recording)
    if recording.theta2 is not None and arm.joints > 1:
        point[1] = recording.theta2
    coupled = any(s.mount == "previous" for s in arm.segments[1:])
    moving = recording.theta2 is None and (coupled or any(arm.gravity))
    names = [f"theta{k + 1}" for k in range(arm.joints)]
    if moving and recording.has(*names):
        schedule = np.zeros((len(recording.time), n))
        for k, name in enumerate(names):
            schedule[:, k] = recording[name]
        return schedule
    return at_rest(point, n)[None, :n]
