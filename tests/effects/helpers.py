"""Models with effects, their motions, and fits of data in which an effect is hidden."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from flexgui.core.arm.arm import Arm
from flexgui.core.effects import Effect, EffectParameter, Rig, catalogue, effect
from flexgui.core.effects.sizes import Sizes, sizes_of
from flexgui.core.identify.refinement import refine
from flexgui.core.model import Model
from flexgui.core.recording.recording import Recording
from flexgui.core.recording.spec import SimulateSpec
from flexgui.core.sensors import sensors
from flexgui.core.simulate.batch import run
from flexgui.core.simulate.experiment import NoiseLevels, make_task, simulate_recording
from flexgui.core.simulate.linear import respond
from flexgui.core.simulate.motion import Task
from flexgui.core.trajectory import Trajectory
from tests.helpers import PAPER, looped
from tests.identify.helpers import residuals_of, with_channels

KINDS = sorted(catalogue())

POSTURES = (0.9, 1.9)
"""rad, theta2 of the two recordings of a fit: on both sides of the right angle."""

NOISE = NoiseLevels({"z": 1e-4, "encoder": 3e-5})
"""m and rad: well above what simulations inside a fit may be wrong by."""

SECONDS = 0.5
"""Of a recording: some twenty-five holds of the excitation."""

SUBSTEPS = 8
"""For comparisons of motions with each other, where only equality counts."""


def experiment(model: Model, theta2: float = 1.2, **spec: Any) -> Task:
    """The task that a recording of the model would have, short by default."""
    given = {"seconds": SECONDS, "seed": 1, **spec}
    return make_task(model, SimulateSpec(theta2=theta2, **given), "r")[0]


def moved(model: Model, task: Task, level: str | None = None) -> Trajectory:
    """The motion at the model's level with a fixed number of steps."""
    numbers = model.numbers()
    if (level or model.level) == "lpv":
        return respond(model, [numbers], [task])[0]
    return run(model, numbers, task, SUBSTEPS)


def readings(model: Model, motion: Trajectory, dt: float) -> dict[str, np.ndarray]:
    """What all sensors of the model read along a motion, (N, k) by their kind."""
    return {
        kind: model.sensed(kind, np.array(sensor.measure(motion)), dt, {})
        for kind, sensor in sensors().items()
        if kind not in ("y", "ydot") or motion.arm.two_revolute
    }


@cache
def motions(arm: Arm) -> tuple[Trajectory, ...]:
    """Of the bare arm in its velocity loop, at both postures."""
    model = looped(arm)
    return tuple(moved(model, experiment(model, x)) for x in POSTURES)


def sizes(arm: Arm = PAPER) -> Sizes:
    """What the effects' sizes are relative to."""
    return sizes_of(motions(arm))


def rig_of(model: Model, **changes: Any) -> Rig:
    given = Rig(model.arm, model.drive, model.level, ("z", "encoder"))
    return replace(given, **changes)


def base_for(one: Effect, arm: Arm = PAPER) -> Model:
    """The velocity-loop model of the arm, at the level where the effect applies."""
    model = looped(arm)
    return looped(arm, level="lpv") if one.not_applicable(rig_of(model)) else model


def parameters_of(one: Effect, arm: Arm = PAPER) -> tuple[EffectParameter, ...]:
    """The effect's parameters on the arm that it makes of this one."""
    return one.parameters(one.changed_arm(arm, {}), looped(arm).drive, sizes(arm))


def primary(one: Effect, arm: Arm = PAPER) -> tuple[EffectParameter, ...]:
    return tuple(k for k in parameters_of(one, arm) if not k.secondary)


def neutral(quantities: Sequence[EffectParameter]) -> dict[str, float]:
    return {k.parameter.name: k.neutral for k in quantities}


def with_effect(kind: str, base: Model, values: Mapping[str, float] | None = None) -> Model:
    """The base with one effect and what it includes, at its start or at `values`."""
    return base.with_effects([effect(kind)], values, sizes(base.arm))


def forced(one: Effect, base: Model, values: Mapping[str, float]) -> Model:
    """The base with this effect alone kept in it, even where `values` are its neutral ones.

    Its other parameters, and those of what it includes, are neutral.
    """
    arm = one.changed_arm(base.arm, values)
    held: dict[str, float] = {}
    for part in (*(effect(kind) for kind in one.includes), one):
        held |= neutral(part.parameters(arm, base.drive, sizes(base.arm)))
    return replace(base, arm=arm, effects=(one,), effect_values={**held, **values}, bare=base)


@dataclass(frozen=True)
class Recovery:
    """Sizes put into simulated recordings, and what a fit from elsewhere makes of them."""

    truth: np.ndarray
    found: np.ndarray
    std: np.ndarray
    misfit: float
    """Mean square of the residuals in units of the noise."""

    @property
    def deviations(self) -> np.ndarray:
        """Of the estimates from the truth, in their standard deviations."""
        return np.abs(self.found - self.truth) / self.std


OUTPUTS = ("z", "encoder")
CHANNELS = {"z1": "z", "z2": "z", "theta1": "encoder", "theta2": "encoder"}

BEGIN = 0.7
"""Times the true size: where a fit begins."""


def hidden_recordings(model: Model) -> list[Recording]:
    """Noisy recordings of a model, one per posture.

    The first sample of the encoders is exact: it is where a model starts, and its noise would
    be an error of all samples.
    """
    made = []
    for i, x in enumerate(POSTURES):
        spec = SimulateSpec(theta2=x, seed=10 + i, seconds=SECONDS, level=model.level)
        r = simulate_recording(model, spec, f"r{i + 1}", noise=NOISE)
        exact = {}
        for k, place in enumerate((0.0, x)):
            name = f"theta{k + 1}"
            exact[name] = np.concatenate([[place], r[name][1:]])
        made.append(with_channels(r, exact))
    return made


def recover(kind: str) -> Recovery:
    """Simulates with the effect at its start, and fits its sizes from elsewhere.

    What the effect includes and its secondary parameters are held at the truth; what these
    recordings cannot show is neutral.
    """
    one = effect(kind)
    base = base_for(one)
    shown = [k for k in primary(one) if one.shown(k.parameter.name, rig_of(base))]
    truth = {k.parameter.name: k.parameter.value for k in shown}
    begin = {k.parameter.name: _begin(k) for k in shown}
    model = with_effect(kind, base, truth)
    weights = {name: 1.0 / NOISE.by_output[output] for name, output in CHANNELS.items()}
    residuals = residuals_of(
        model, hidden_recordings(model), parameters=tuple(truth), output=OUTPUTS,
        start=begin, weights=weights,
    )  # fmt: skip
    refined = refine(residuals, residuals.unknowns.parameters.vector(), lambda cost: False)
    J = residuals.vector(residuals.slopes(refined.vector))
    std = np.sqrt(np.diag(np.linalg.inv(J.T @ J)))  # the weights make the noise one
    true = np.array(list(truth.values()))
    return Recovery(true, refined.vector, std, refined.cost / residuals.count)


def _begin(quantity: EffectParameter) -> float:
    """BEGIN times as far from neutral, where neutral is a size at all."""
    value, rest = quantity.parameter.value, quantity.neutral
    inside = quantity.parameter.lower <= rest <= quantity.parameter.upper
    return rest + BEGIN * (value - rest) if inside else BEGIN * value
