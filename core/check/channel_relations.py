"""Relations between the channels of a recording: gain, lag and drift.

Three sources: the scenario's closed loop with the recorded references, which predicts every sensor;
a reference and its response; Newton's law between a joint's torque and motion.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..check.gain_and_lag import (
    DIRECT,
    LEAST_EXPLAINED,
    LOOP,
    Relation,
    best_lag,
    fit_gains_and_lags,
    relate,
    smoothed,
)
from ..check.inverse_dynamics import torque_relations
from ..check.link_bending import LinkShape
from ..check.measured_recording import MeasuredRecording
from ..model import Model
from ..recording.channels import Role, is_reference, role_of
from ..sensors import sensors
from ..simulate.batch import run
from ..simulate.linear import respond
from ..simulate.motion import Task, at_rest
from ..trajectory import Trajectory

SUBSTEPS = 8
"""Steps per sample: the loop's motion within a per cent."""
SMALL = 0.3
"""rad (m): below, responses to the references add up within a few per cent."""


def relations(
    recording: MeasuredRecording, quick: bool = False, shape: LinkShape | None = None
) -> tuple[Relation, ...]:
    """All relations, once per recording; only servo relations without a model. `quick` leaves out
    what each reference does by itself; `shape`: the links as the recordings show them."""
    key = relations, quick, id(shape)
    if key not in recording.cache:
        recording.cache[key] = shape, _relations(recording, quick, shape)
    return recording.cache[key][1]


def _relations(
    recording: MeasuredRecording, quick: bool, shape: LinkShape | None
) -> tuple[Relation, ...]:
    all_relations = [*_servos(recording)]
    if recording.model is not None:
        all_relations += _loop(recording, recording.model, quick)
        all_relations += torque_relations(recording, recording.model, shape)
    return tuple(all_relations)


def _servos(recording: MeasuredRecording) -> list[Relation]:
    servo_relations = []
    for output in recording.names("theta#", "i#"):
        reference = f"{output}_ref"
        if not recording.has(reference):
            continue
        x, y = recording.even(reference), recording.even(output)
        relation = relate(output, (reference,), y, [x - x[0]], recording.step, DIRECT)
        if relation:
            if role_of(output) is Role.PLACE:
                relation = replace(relation, gain=_level(y, x, relation, recording.step))
            servo_relations.append(relation)
    return servo_relations


def _level(y: np.ndarray, x: np.ndarray, relation: Relation, dt: float) -> float:
    """Gain of positions, not of speeds: where a servo settles, however slowly."""
    t = dt * np.arange(len(x))
    reference = np.interp(t - relation.lag, t, x)
    reference = reference - reference.mean()
    size = float(np.sum(reference**2))
    gain = float(np.sum(reference * (y - y.mean()))) / size if size > 0 else 0.0
    return gain or relation.gain


def _loop(recording: MeasuredRecording, model: Model, quick: bool) -> list[Relation]:
    """Relations of every sensor to the scenario's closed loop under the recorded references."""
    references = model.drive.reference_channels(model.arm)
    if not all(is_reference(r) and role_of(r) in (Role.PLACE, Role.SPEED) for r in references):
        return []
    if not references or not recording.has(*references):
        return []
    start = _posture(recording, model)
    if start is None:
        return []
    signals = np.column_stack([recording.even(r) for r in references])

    values = tuple(recording.values.items())
    key = (id(model), values, recording.step, start.tobytes(), hash(signals.tobytes()))
    if key not in recording.loop_responses:
        answer = _predicted(model, recording.grid, signals, start, recording.values)
        recording.loop_responses[key] = model, answer  # a model that is kept keeps its id
    together = recording.loop_responses[key][1]
    if together is None:
        return []
    joints = model.arm.joints
    moved = max((np.ptp(together[f"theta{k + 1}"]) for k in range(joints)), default=0.0)
    rates = all(role_of(r) is Role.SPEED for r in references)
    singles = []
    if not quick and moved < SMALL and joints > 1 and rates:
        singles = _single_responses(model, recording.grid, signals, start, recording.values)
    return _compared(recording, references, together, singles)


def _compared(
    recording: MeasuredRecording, references: tuple[str, ...],
    together: Mapping[str, np.ndarray], singles: Sequence[Mapping[str, np.ndarray]],
) -> list[Relation]:  # fmt: skip
    """Relations of each channel to its response to all references, and to each one of them."""
    compared: list[Relation] = []
    for name in [n for n in together if recording.has(n)]:
        y = recording.even(name)
        whole = relate(name, references, y, [together[name]], recording.step, LOOP)
        compared += [whole] if whole else []
        if all(name in single for single in singles) and singles:
            parts = [single[name] for single in singles]
            first = whole.lag if whole and whole.explained > LEAST_EXPLAINED else 0.0
            compared += _by_reference(name, references, y, parts, recording.step, first)
    return compared


def _by_reference(
    name: str, references: Sequence[str], y: np.ndarray, parts: Sequence[np.ndarray], dt: float,
    lag: float,
) -> list[Relation]:  # fmt: skip
    """Gains of all references in a channel, fitted together; the lags begin at `lag` s, or where
    each part, the largest first, agrees best with the rest, whichever explains more."""
    moves, each = smoothed(y), smoothed(np.array(parts))
    t, left, lags = dt * np.arange(len(y)), moves - each.sum(axis=0), np.zeros(len(each))
    for k in np.argsort(-np.std(each, axis=1)):
        lags[k], _ = best_lag(left + each[k], each[k], dt)
        left = left + each[k] - np.interp(t - lags[k], t, each[k])
    fits = [fit_gains_and_lags(moves, each, dt, first) for first in (lag, lags)]
    fit = max(fits, key=lambda one: one.explained)
    return [
        Relation(name, (reference,), float(gain), float(late), 0.0, np.inf, fit.explained, LOOP,
                 part, step=dt)
        for reference, gain, late, share, part in zip(
            references, fit.gains, fit.lags, fit.shares, parts, strict=True
        )
        if share > 0.1 and fit.explained > LEAST_EXPLAINED
    ]  # fmt: skip


def _posture(recording: MeasuredRecording, model: Model) -> np.ndarray | None:
    names = [f"theta{k + 1}" for k in range(model.arm.joints)]
    return np.array([recording.even(n)[0] for n in names]) if recording.has(*names) else None


def _single_responses(
    model: Model, time: np.ndarray, signals: np.ndarray, joints: np.ndarray,
    values: Mapping[str, float],
) -> list[dict[str, np.ndarray]]:  # fmt: skip
    """Channels (M,) of the linear loop's response to each reference (M,) by itself; empty if one
    diverges. The motion is small, so that these responses add up."""
    n, numbers = model.arm.coordinates, model.numbers(values)
    start = at_rest(joints, n, numbers.law.states)
    each = [signals * chosen for chosen in np.eye(signals.shape[1])]
    tasks = [Task(time, single, start, start[None, :n]) for single in each]
    with np.errstate(all="ignore"):
        motions = respond(model, [numbers] * len(tasks), tasks)
        responses = [_measured(model, motion) for motion in motions]
    return [response for response in responses if response] if all(responses) else []


def _predicted(
    model: Model, time: np.ndarray, signals: np.ndarray, joints: np.ndarray,
    values: Mapping[str, float],
) -> dict[str, np.ndarray] | None:  # fmt: skip
    """Channels (M,) of the loop's motion; None if it diverges."""
    numbers = model.numbers(values)
    start = at_rest(joints, model.arm.coordinates, numbers.law.states)
    task = Task(time, signals, start, start[None, : model.arm.coordinates])
    try:
        with np.errstate(all="ignore"):
            motion = run(model, numbers, task, SUBSTEPS)
            return _measured(model, motion)
    except (ValueError, ArithmeticError, np.linalg.LinAlgError):
        return None


def _measured(model: Model, motion: Trajectory) -> dict[str, np.ndarray] | None:
    channels: dict[str, np.ndarray] = {}
    for kind, sensor in sensors().items():
        if kind in ("y", "ydot") and not motion.arm.two_revolute:
            continue
        values = np.array(sensor.measure(motion))
        for k, channel in enumerate(sensor.channels(motion.arm)):
            channels[channel.name] = values[:, k]
    good = all(np.isfinite(channels[n]).all() for n in channels if role_of(n) is Role.PLACE)
    return {n: v for n, v in channels.items() if np.isfinite(v).all()} if good else None
