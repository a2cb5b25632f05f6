"""The joint torque that a model lacks, where no virtual servo tells it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..arm.joints import joint
from ..diagnose.fit_problem import Hypothesis
from ..identify.prepared import Prepared
from ..results import MissingTorque, RecordingComparison
from ..simulate.disturbance import Behind, torque_answer, torque_behind
from ..simulate.posture import Posture, posture

MOST_ROWS = 20_000
"""Longer recordings would take seconds each."""

NEAR = 0.25
"""rad (m) beside its mean that a joint beyond the first may move: the coupling of two links goes
with the cosine of the angle between them, and changes by a quarter at most. The first turns the
whole arm, whose inertia stays."""

SLOW = 3
"""Frequencies of a recording that hold what is constant or drifts: much may cause that."""

Found = tuple[tuple[MissingTorque, ...], float | None]
"""A joint each, and the agility that was used or chosen."""


def missing_torque(
    h: Hypothesis, i: int, seen: RecordingComparison, floors: Mapping[str, float],
    agility: float | None,
) -> Found:  # fmt: skip
    """Of recording i of a hypothesis; nothing where it is known already, where the arm moves too
    far for one linear model, or where the outputs passed a filter."""
    experiment = h.residuals.experiments[i]
    chosen = [c for c in seen.channels if c.channel in floors and c.counted.all()]
    if not (_plain(h, experiment) and chosen and seen.motion) or len(chosen[0].time) > MOST_ROWS:
        return (), agility
    behind = torque_behind(
        _calm(h, experiment),
        [c.channel for c in chosen],
        np.column_stack([c.residual for c in chosen]),
        [floors[c.channel] for c in chosen],
        experiment.recording.sample_time,
        agility,
    )
    if behind is None:
        return (), agility
    motion = h.residuals.predictor.trajectories([(h.vector, [i])])[0][0][0]
    each = (_one(k, behind, seen, motion.torque[:, k], h) for k in range(h.model.arm.joints))
    return tuple(each), behind.agility


def _calm(h: Hypothesis, experiment: Prepared) -> Posture:
    """The linear model at the working point, with the effects that have a place in one: the slope
    of a wave or of a friction at rest says nothing about a motion through it."""
    values = h.residuals.predictor.values(experiment, h.vector)
    smooth = [one for one in h.model.effects if one.linear]
    model = h.model.with_effects(smooth, {**h.model.effect_values, **values})
    joints = np.mean(experiment.task.schedule[:, : model.arm.joints], axis=0)
    return posture(model, joints, model.numbers(values))


@dataclass(frozen=True)
class Pushed:
    """A recording that tells what pushed its joints beside the model."""

    place: np.ndarray
    """(N, joints): how the joints moved"""
    speed: np.ndarray
    error: np.ndarray
    """(N, k) in floors, of the channels that answer a torque linearly"""
    answer: np.ndarray
    """(F, k, joints): of these to a torque, at the frequencies of `numpy.fft.rfft` from SLOW on"""


def pushed(
    h: Hypothesis, i: int, error: np.ndarray, floors: np.ndarray, agility: float | None
) -> tuple[Pushed | None, float | None]:
    """Of recording i, from its error (M, k), measured minus modelled, and the floors (k,); None
    where `missing_torque` tells nothing either."""
    e = h.residuals.experiments[i]
    if not (_plain(h, e) and e.counted.all()) or len(error) > MOST_ROWS:
        return None, agility
    names, dt, at = [c[0] for c in e.channels], e.recording.sample_time, _calm(h, e)
    behind = torque_behind(at, names, error, floors.tolist(), dt, agility)
    if behind is None:
        return None, agility
    known, answer = torque_answer(at, names, dt, np.fft.rfftfreq(len(error))[SLOW:])
    motion = h.residuals.predictor.trajectories([(h.vector, [i])])[0][0][0]
    nj = h.model.arm.joints
    return Pushed(
        place=motion.q[:, :nj] + behind.place,
        speed=motion.v[:, :nj] + behind.speed,
        error=error[:, known] / floors[known],
        answer=answer / floors[known][None, :, None],
    ), behind.agility


def _plain(h: Hypothesis, experiment: Prepared) -> bool:
    """Whether one linear model tells how the outputs answer a torque."""
    places = experiment.task.schedule[:, 1 : h.model.arm.joints]
    still = np.all(np.abs(places - places.mean(axis=0)) <= NEAR)
    return experiment.processing.nothing and h.model.steering is None and bool(still)


def _one(
    k: int, behind: Behind, seen: RecordingComparison, applied: np.ndarray, h: Hypothesis
) -> MissingTorque:
    """What the drive spends beyond what the model needs: the torque behind the error, turned."""
    kind, time = joint(h.model.arm.segments[k].joint), seen.channels[0].time
    assert seen.motion is not None
    return MissingTorque(
        joint=k + 1,
        unit=kind.effort_unit,
        time=time,
        velocity=seen.motion.velocity[:, k] + behind.speed[:, k],
        velocity_unit=f"{kind.coordinate_unit}/s",
        missing=-behind.torque[:, k],
        applied=applied,
        counted=np.ones(len(time), dtype=bool),
    )
