"""How the outputs of a fitted model answer forces that are given over time.

A term of an unknown law is a signal along the motion. Simulated as a small force, each gives one
column of errors; all that is asked later of terms and their sums is linear algebra with these.
"""

from __future__ import annotations

from collections.abc import Sequence
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
from ..estimate.problem import FitData, Problem, problem_of
from ..forces.element import Element
from ..forces.law import ForceLaw, V, X
from ..identify.predictor import MotionCache, simulate_together
from ..identify.prepared_recording import make_task
from ..recording.recording import Recording

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
    unit = _size(model.data)
    without = _with_probe(model, probe, [np.zeros_like(x) for x in signals[0]])
    before = without.errors(without.vector)
    answers = []
    for at in range(0, len(signals), BATCH):
        sizes = [_rms(signal) or 1.0 for signal in signals[at : at + BATCH]]
        each = [
            _with_signal(without, [x / size for x in signal])
            for signal, size in zip(signals[at : at + BATCH], sizes, strict=True)
        ]
        simulate_together([(problem.residuals.predictor, problem.vector) for problem in each])
        for problem, size in zip(each, sizes, strict=True):
            pairs = zip(before, problem.errors(problem.vector), strict=True)
            answers.append(tuple((a - b) * (size / unit) for a, b in pairs))
    return answers


def _with_probe(model: FittedModel, probe: Probe, signal: Sequence[np.ndarray]) -> Problem:
    """The model with a probe that follows a signal (N,) per recording, in half of the steps: only
    the direction of a change matters."""
    base, size = model.refit.problem, _size(model.data)
    experiments = tuple(
        replace(e, recording=_followed(e.recording, x))
        for e, x in zip(model.data.experiments, signal, strict=True)
    )
    data = replace(model.data, experiments=experiments, anchor=None, motion_cache=MotionCache())
    own = [u for u in base.unknowns.items if u.parameter.name in base.model.effect_values]
    values = {**base.all_values(), SIZE: size}
    return problem_of(data, [*model.effects, probe], values, freed=own, refine=TRIAL_SUBSTEPS)


def _followed(recording: Recording, signal: np.ndarray) -> Recording:
    return replace(recording, channels={**recording.channels, SIGNAL: signal})


def _with_signal(problem: Problem, signal: Sequence[np.ndarray]) -> Problem:
    """A model with a probe that follows another signal (N,) per recording."""
    predictor = problem.residuals.predictor
    pairs = zip(predictor.experiments, signal, strict=True)
    recordings = [(e, _followed(e.recording, x)) for e, x in pairs]
    experiments = [replace(e, recording=r, task=make_task(e.model, r)) for e, r in recordings]
    other = replace(predictor, experiments=experiments, motion_cache=MotionCache())
    return replace(problem, residuals=replace(problem.residuals, predictor=other))


def _size(data: FitData) -> float:
    """Of the force where the signal is one, N m or N."""
    return SIGNAL_SHARE * float(np.max(data.sizes.torque))


def _rms(signal: Sequence[np.ndarray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(list(signal)) ** 2)))
