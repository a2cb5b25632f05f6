"""How the outputs of a fitted model answer forces that are given over time.

A term of an unknown law is a signal along the motion. Simulated as a small force, each gives one
column of errors; all that is asked later of terms and their sums is linear algebra with these.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp

from ..arm.arm import Arm
from ..diagnose.output_changes import TRIAL_SUBSTEPS
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter, Values
from ..effects.per_joint import joint_direction, sized
from ..effects.sizes import Sizes
from ..estimate.fitted_model import FittedModel
from ..estimate.problem import FitData, problem_of
from ..forces.element import Element
from ..forces.law import ForceLaw, V, X
from ..identify.predictor import Moving, Predictor, job_of
from ..identify.prepared_recording import Prepared
from ..identify.prescribed_joint_forces import simulated_part, with_prescribed_forces
from ..identify.prescribed_joints import fully_prescribed_motion
from ..model import Model, Numbers
from ..processors import workers
from ..simulate.batch import run_many
from ..simulate.motion import Task

SIZE = "probe_size"
SIGNAL = "probe"

SIGNAL_SHARE = 0.02
"""Of the typical torque: the rms of a signal as it is tried."""

_A, _S = sp.symbols("a s", real=True)
AT_JOINT = ForceLaw((X,), (V,), (_A * _S,), (_A, _S))
_ZX, _ZV = sp.symbols("x1 x2", real=True), sp.symbols("v1 v2", real=True)
AT_TIP = tuple(
    ForceLaw(_ZX, _ZV, tuple(_A * _S if i == k else sp.Integer(0) for i in (0, 1)), (_A, _S))
    for k in (0, 1)
)


@dataclass(frozen=True)
class Place:
    """Where a probe pushes: a joint or a component at the tip, from 0."""

    number: int
    tip: bool

    def element(self, arm: Arm, numbers: tuple[float, ...]) -> Element:
        """The force there."""
        if self.tip:
            return Element(AT_TIP[self.number], (), numbers, True, (), (SIGNAL,))
        direction = joint_direction(arm, self.number)
        return Element(AT_JOINT, (direction,), numbers, False, (), (SIGNAL,))


def at_joint(number: int) -> Place:
    """Joint `number`, from 0."""
    return Place(number, False)


def at_tip(number: int) -> Place:
    """Component `number`, from 0, of the tip's force."""
    return Place(number, True)


@dataclass(frozen=True)
class Probe(Effect):
    """A force at a place that follows the column SIGNAL of a recording."""

    acts: Place
    kind: str = "probe"
    inputs: tuple[str, ...] = (SIGNAL,)

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        return (sized(SIZE, SIGNAL_SHARE * float(np.max(sizes.torque)), "", "size", signed=True),)

    def elements(self, arm: Arm, p: np.ndarray, values: Values) -> tuple[Element, ...]:
        return (self.acts.element(arm, (values[SIZE], 0.0)),)


BATCH = 32
"""Signals that are simulated together; their motions are kept until they are read."""


def responses(
    model: FittedModel, probe: Probe, signals: Sequence[Sequence[np.ndarray]]
) -> list[tuple[np.ndarray, ...]]:
    """Per signal the change of the outputs (M, k) of each recording by a force of that signal, in
    noise floors; nothing that is masked.

    Args:
        model: At its minimum.
        probe: Where the force acts.
        signals: Per signal and recording (N,), in N m or N.
    """
    run = _ProbedRun.of(model, probe)
    before = run.outputs([[np.zeros_like(x) for x in signals[0]]])[0]
    answers = []
    for at in range(0, len(signals), BATCH):
        some = signals[at : at + BATCH]
        sizes = [_rms(signal) or 1.0 for signal in some]
        scaled = [[x / size for x in s] for s, size in zip(some, sizes, strict=True)]
        for outputs, size in zip(run.outputs(scaled), sizes, strict=True):
            answers.append(run.weighted(before, outputs, size / run.size))
    return answers


@dataclass(frozen=True)
class _ProbedRun:
    """A model with a probe, which is not one of its unknowns, in half of the steps: only the
    direction of a change matters."""

    predictor: Predictor
    weights: Sequence[np.ndarray]
    each: Sequence[tuple[Prepared, Numbers, Mapping[str, float]]]
    size: float
    """Of the force where the signal is one."""

    @classmethod
    def of(cls, model: FittedModel, probe: Probe) -> _ProbedRun:
        base, data = model.refit.problem, _with_signal(model.data)
        own = [u for u in base.unknowns.items if u.parameter.name in base.model.effect_values]
        size = SIGNAL_SHARE * float(np.max(data.sizes.torque))
        values = {**base.model.effect_values, **base.values(), SIZE: size}
        effects = [*model.effects, probe]
        problem = problem_of(data, effects, values, freed=own, refine=TRIAL_SUBSTEPS)
        predictor, each = problem.residuals.predictor, []
        for e in predictor.experiments:
            own_values = predictor.values(e, problem.vector)
            each.append((e, e.model.numbers(own_values), own_values))
        return cls(predictor, problem.residuals.weights, each, size)

    def outputs(self, signals: Sequence[Sequence[np.ndarray]]) -> list[list[np.ndarray]]:
        """(M, k) per signal and recording."""
        steps = self.predictor.steps
        assert steps is not None  # a search has found them
        asked = [(each, x) for signal in signals for each, x in zip(self.each, signal, strict=True)]
        moving = [
            Moving(e, simulated_part(e.model, n), _with_input(e.model, e.task_at(v), x))
            for (e, n, v), x in asked
        ]
        if all(m.is_given for m in moving):
            motions = [fully_prescribed_motion(*m.parts) for m in moving]
        else:
            motions = run_many([job_of(*m.parts) for m in moving], steps, workers())
        read = []
        for ((e, n, v), _), m, motion in zip(asked, moving, motions, strict=True):
            whole = with_prescribed_forces(e.model, n, motion, m.task.inputs)
            read.append(e.processed(e.readings(whole, n, v)))
        R = len(self.each)
        return [read[at : at + R] for at in range(0, len(read), R)]

    def weighted(
        self, before: Sequence[np.ndarray], after: Sequence[np.ndarray], factor: float
    ) -> tuple[np.ndarray, ...]:
        """The changes of the outputs in noise floors, times the factor."""
        changes = []
        for (e, _, _), y, z, w in zip(self.each, before, after, self.weights, strict=True):
            change = e.standstill.removed_from(np.where(e.counted, z - y, 0.0))
            changes.append(change * (w * factor))
        return tuple(changes)


def _with_input(model: Model, task: Task, signal: np.ndarray) -> Task:
    """The task with the signal of the probe (N,)."""
    assert task.inputs is not None
    inputs = task.inputs.copy()
    inputs[:, model.inputs.index(SIGNAL)] = signal
    return replace(task, inputs=inputs)


def _with_signal(data: FitData) -> FitData:
    """The data with a column for the signal, of zeros."""
    experiments = tuple(
        replace(
            e,
            recording=replace(
                r := e.recording, channels={**r.channels, SIGNAL: np.zeros(len(r.time))}
            ),
        )
        for e in data.experiments
    )
    return replace(data, experiments=experiments, anchor=None)


def _rms(signal: Sequence[np.ndarray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(list(signal)) ** 2)))
