"""The joint torque that a model lacks, without a virtual servo."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from .arm.joints import joint
from .estimate.problem import Problem
from .identify.prepared_recording import Prepared
from .results import MissingTorque, RecordingComparison
from .simulate.disturbance import JointTorque, estimate_torque, torque_answer
from .simulate.posture import Posture, posture

MOST_ROWS = 20_000
"""Longer recordings would take seconds each."""

MOST_MOVED = 0.25
"""rad (m) that a joint beyond the first may move from its mean: coupling of two links depends on
the cosine of their angle and changes by a quarter at most. The first joint turns the whole arm,
whose inertia stays."""

FIRST_FREQUENCY = 3
"""Lowest frequencies that are left out: constants and drift have many causes."""

MissingTorques = tuple[tuple[MissingTorque, ...], float | None]
"""One record per joint, and the agility that was used or chosen."""


def missing_torque(
    problem: Problem, i: int, comparison: RecordingComparison, floors: Mapping[str, float],
    agility: float | None,
) -> MissingTorques:  # fmt: skip
    """Missing torque along recording i, and the `agility` (N m/√s), chosen if None; no torque if a
    servo shows it already, if one linear model does not hold, or if the outputs are filtered."""
    experiment = problem.residuals.experiments[i]
    chosen = [c for c in comparison.channels if c.channel in floors and c.counted.all()]
    if (
        not (_one_linear_model(problem, experiment) and chosen and comparison.motion)
        or len(chosen[0].time) > MOST_ROWS
    ):
        return (), agility
    behind = estimate_torque(
        _linearised(problem, experiment), [c.channel for c in chosen],
        np.column_stack([c.residual for c in chosen]), [floors[c.channel] for c in chosen],
        experiment.recording.sample_time, agility,
    )  # fmt: skip
    if behind is None:
        return (), agility
    motion = problem.residuals.predictor.trajectories([(problem.vector, [i])])[0][0][0]
    each = (
        _joint_record(k, behind, comparison, motion.torque[:, k], problem)
        for k in range(problem.model.arm.joints)
    )
    return tuple(each), behind.agility


def _linearised(problem: Problem, experiment: Prepared) -> Posture:
    """The linear model at the working point, without effects that have no linear model: the slope
    of friction at rest says nothing about a motion."""
    values = problem.residuals.predictor.values(experiment, problem.vector)
    smooth = [e for e in problem.model.effects if e.linear]
    model = problem.model.with_effects(smooth, {**problem.model.effect_values, **values})
    joints = np.mean(experiment.task.schedule[:, : model.arm.joints], axis=0)
    return posture(model, joints, model.numbers(values))


@dataclass(frozen=True)
class ErrorResponse:
    """A recording's error, and its response to joint torques."""

    place: np.ndarray
    """(N, joints): joint positions"""
    speed: np.ndarray
    error: np.ndarray
    """(N, k) in noise floors, of the channels that respond linearly to a torque"""
    response: np.ndarray
    """(F, k, joints): their response to a torque, at the frequencies of `numpy.fft.rfft` from
    FIRST_FREQUENCY on"""


def error_response(
    problem: Problem, i: int, error: np.ndarray, floors: np.ndarray, agility: float | None
) -> tuple[ErrorResponse | None, float | None]:
    """The response of recording i, from its error (M, k), measured minus modelled, and the noise
    floors (k,), and the `agility` (N m/√s); None where `missing_torque` gives nothing."""
    e = problem.residuals.experiments[i]
    if not (_one_linear_model(problem, e) and e.counted.all()) or len(error) > MOST_ROWS:
        return None, agility
    names, dt, at = [c[0] for c in e.channels], e.recording.sample_time, _linearised(problem, e)
    behind = estimate_torque(at, names, error, floors.tolist(), dt, agility)
    if behind is None:
        return None, agility
    which, response = torque_answer(at, names, dt, np.fft.rfftfreq(len(error))[FIRST_FREQUENCY:])
    motion = problem.residuals.predictor.trajectories([(problem.vector, [i])])[0][0][0]
    nj = problem.model.arm.joints
    return ErrorResponse(
        place=motion.q[:, :nj] + behind.place,
        speed=motion.v[:, :nj] + behind.speed,
        error=error[:, which] / floors[which],
        response=response / floors[which][None, :, None],
    ), behind.agility


def _one_linear_model(problem: Problem, experiment: Prepared) -> bool:
    """Whether one linear model gives the outputs' response to a torque."""
    places = experiment.task.schedule[:, 1 : problem.model.arm.joints]
    still = np.all(np.abs(places - places.mean(axis=0)) <= MOST_MOVED)
    return experiment.processing.nothing and problem.model.steering is None and bool(still)


def _joint_record(
    k: int,
    behind: JointTorque,
    comparison: RecordingComparison,
    applied: np.ndarray,
    problem: Problem,
) -> MissingTorque:
    """The torque that the drive applies beyond the model's: minus the torque that explains the
    error."""
    kind, time = joint(problem.model.arm.segments[k].joint), comparison.channels[0].time
    assert comparison.motion is not None
    return MissingTorque(
        joint=k + 1, unit=kind.effort_unit, time=time,
        velocity=comparison.motion.velocity[:, k] + behind.speed[:, k],
        velocity_unit=f"{kind.coordinate_unit}/s", missing=-behind.torque[:, k], applied=applied,
        counted=np.ones(len(time), dtype=bool),
    )  # fmt: skip
