"""The joint torque that a model lacks, where no virtual servo tells it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from core.arm.joints import joint
from core.diagnose.data import Hypothesis
from core.results import MissingTorque, RecordingComparison
from core.simulate.disturbance import Behind, torque_behind
from core.simulate.posture import posture

MOST_ROWS = 20_000
"""Longer recordings would take seconds each."""

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
    plain = experiment.processing.nothing and h.model.steering is None
    still = len(experiment.task.schedule) == 1
    if not (plain and still and chosen and seen.motion) or len(chosen[0].time) > MOST_ROWS:
        return (), agility
    values = h.residuals.predictor.values(experiment, h.vector)
    joints = experiment.task.schedule[0, : h.model.arm.joints]
    behind = torque_behind(
        posture(h.model, joints, h.model.numbers(values)),
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
        recorded=applied,
        counted=np.ones(len(time), dtype=bool),
    )
