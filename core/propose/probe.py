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
from ..diagnose.fit_problem import FitProblem, ParametrisedModel, parametrised
from ..diagnose.fitted_model import FittedModel
from ..diagnose.output_changes import TRIAL_SUBSTEPS
from ..drives.drive import Drive
from ..effects.effect import Effect, EffectParameter, Values
from ..effects.per_joint import joint_direction, sized
from ..effects.sizes import Sizes
from ..forces.element import Element
from ..forces.law import ForceLaw, V, X
from ..identify.predictor import simulate_together

SIZE = "probe_size"
SIGNAL = "probe"

SHARE = 0.02
"""Of the typical torque: the rms of a signal as it is tried."""

_A, _S = sp.symbols("a s", real=True)
AT_JOINT = ForceLaw((X,), (V,), (_A * _S,), (_A, _S))
_ZX, _ZV = sp.symbols("x1 x2", real=True), sp.symbols("v1 v2", real=True)
AT_TIP = tuple(
    ForceLaw(_ZX, _ZV, tuple(_A * _S if i == k else sp.Integer(0) for i in (0, 1)), (_A, _S))
    for k in (0, 1)
)


@dataclass(frozen=True)
class Target:
    """Where a law acts."""

    name: str
    """As a formula's target: joint1, ..., tip1, tip2."""
    number: int
    """From 0."""
    at_tip: bool


def targets(arm: Arm) -> tuple[Target, ...]:
    """All joints, then the components of the force at the tip."""
    joints = tuple(Target(f"joint{k + 1}", k, False) for k in range(arm.joints))
    return (*joints, *(Target(f"tip{k + 1}", k, True) for k in (0, 1)))


@dataclass(frozen=True)
class Probe(Effect):
    """A force at a target that follows the column SIGNAL of a recording."""

    target: Target = Target("joint1", 0, False)
    kind: str = "probe"
    inputs: tuple[str, ...] = (SIGNAL,)

    def parameters(self, arm: Arm, drive: Drive, sizes: Sizes) -> tuple[EffectParameter, ...]:
        return (sized(SIZE, SHARE * float(np.max(sizes.torque)), "", "size", signed=True),)

    def elements(self, arm: Arm, p: np.ndarray, values: Values) -> tuple[Element, ...]:
        numbers = (values[SIZE], 0.0)
        k = self.target.number
        if self.target.at_tip:
            return (Element(AT_TIP[k], (), numbers, True, (), self.inputs),)
        return (Element(AT_JOINT, (joint_direction(arm, k),), numbers, False, (), self.inputs),)


def responses(
    model: FittedModel, target: Target, signals: Sequence[Sequence[np.ndarray]]
) -> list[tuple[np.ndarray, ...]]:
    """Per signal the change of the errors (M, k) of each recording by a force of that signal.

    Args:
        model: At its minimum.
        target: Where the force acts.
        signals: Per signal and recording (N,), in N m or N.
    """
    base, data = model.refit.parametrised, model.data
    torque = SHARE * float(np.max(data.sizes.torque))
    sizes = [torque / max(_rms(signal), 1e-300) for signal in signals]
    probed = [
        _probed(model, target, signal, size) for signal, size in zip(signals, sizes, strict=True)
    ]
    nothing = _probed(model, target, [np.zeros_like(x) for x in signals[0]], torque)
    simulate_together([(h.residuals.predictor, base.vector) for h in (nothing, *probed)])
    before = nothing.residuals.blocks(base.vector)
    return [
        tuple((a - b) / size for a, b in zip(before, h.residuals.blocks(base.vector), strict=True))
        for h, size in zip(probed, sizes, strict=True)
    ]


def _probed(
    model: FittedModel, target: Target, signal: Sequence[np.ndarray], size: float
) -> ParametrisedModel:
    """The model with the force, whose size is no unknown, in half of the steps: only the direction
    of the change matters."""
    base = model.refit.parametrised
    own = [u for u in base.unknowns.items if u.parameter.name in base.model.effect_values]
    values = {**base.model.effect_values, **base.values(), SIZE: size}
    data = replace(_with_signal(model.data, signal), anchor=None)
    return parametrised(
        data, [*model.effects, Probe(target)], values, freed=own, refine=TRIAL_SUBSTEPS
    )


def _with_signal(data: FitProblem, signal: Sequence[np.ndarray]) -> FitProblem:
    experiments = tuple(
        replace(
            e, recording=replace(e.recording, channels={**e.recording.channels, SIGNAL: x}),
        )
        for e, x in zip(data.experiments, signal, strict=True)
    )  # fmt: skip
    return replace(data, experiments=experiments)


def _rms(signal: Sequence[np.ndarray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(list(signal)) ** 2)))
