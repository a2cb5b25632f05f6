"""Where a law may act: joints, the tip, and sensors' readings."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arm.arm import Arm
from ..arm.joints import joint
from ..effects.own_reading import readings
from ..estimate.fitted_model import FittedModel
from ..identify.prepared_recording import Prepared
from ..propose.probe import Probe, at_joint, at_tip, responses
from ..propose.variables import (
    COARSE,
    Factor,
    Series,
    Variable,
    bristle_shares,
    joint_variables,
    ones,
    time_of,
    varies,
)
from ..trajectory import Trajectory

QUICK = 0.001
"""rad (m): a bristle that turns over it is dry friction."""

REVERSAL = 0.02
"""Of a joint's rms speed: below it the direction of motion counts in part."""


class Target(ABC):
    """A joint, a component of the tip's force, or a sensor's channel."""

    name: str
    """As the target of an own formula."""
    title: str
    unit: str

    @abstractmethod
    def choices(
        self, model: FittedModel, motions: Sequence[Trajectory]
    ) -> list[tuple[Variable, Factor]]:
        """The variables of a law there, along the motions, each with what its function may be
        multiplied by."""

    def by_direction(
        self, model: FittedModel, motions: Sequence[Trajectory]
    ) -> list[tuple[Variable, Factor, Factor]]:
        """Variables whose function may differ by the direction of motion, with the factors that
        are one forwards and one backwards."""
        return []

    @abstractmethod
    def responses(self, model: FittedModel, signals: Sequence[Series]) -> list[Series]:
        """Per signal the change (M, k) of the outputs of each recording, in noise floors."""


@dataclass(frozen=True)
class ForceTarget(Target):
    """Where a force acts."""

    name: str
    title: str
    unit: str
    probe: Probe

    def responses(self, model: FittedModel, signals: Sequence[Series]) -> list[Series]:
        return responses(model, self.probe, signals)


@dataclass(frozen=True)
class JointTarget(ForceTarget):
    """A joint: its torque (a force on a slide)."""

    number: int
    """From 0."""

    def choices(
        self, model: FittedModel, motions: Sequence[Trajectory]
    ) -> list[tuple[Variable, Factor]]:
        arm, k = model.refit.problem.model.arm, self.number
        kind = joint(arm.segments[k].joint)
        nothing = Factor(kind.effort.capitalize(), "", "", "", ones(motions))
        word, unit = f"theta{k + 1}", kind.coordinate_unit
        direction = self._direction(motions)
        bristle = f"hysteresis({word}, {QUICK})"
        seen_from_elsewhere = replace(direction, formula=bristle, state=bristle)
        speeds = [self._speed(model, motions, j) for j in range(arm.joints)]
        chosen = []
        for x in joint_variables(model, motions, k):
            coarse = replace(x, knots=COARSE)
            chosen.append((x, nothing))
            if x.place or x.own_load:
                chosen.append((coarse, seen_from_elsewhere if x.elsewhere else direction))
            for j, speed in enumerate(speeds):
                product = x.place or x.own_load or (j != k and x.own_speed)
                chosen += [(coarse, speed)] if product else []
        return chosen + [(x, nothing) for x in bristle_shares(motions, k, unit)]

    def by_direction(
        self, model: FittedModel, motions: Sequence[Trajectory]
    ) -> list[tuple[Variable, Factor, Factor]]:
        direction = self._direction(motions)
        sides = []
        for name, sign in (("forwards", 1.0), ("backwards", -1.0)):
            along = tuple(0.5 * (1.0 + sign * d) for d in direction.along)
            formula = f"(1 {'+' if sign > 0.0 else '-'} {direction.formula})/2"
            side = replace(
                direction, words=f"while it moves {name}", formula=formula, along=along,
                brakes=sign > 0.0,
            )  # fmt: skip
            sides.append(side)
        variables = joint_variables(model, motions, self.number)
        return [
            (replace(x, knots=COARSE), sides[0], sides[1])
            for x in variables
            if x.place and not x.elsewhere
        ]

    def _speed(self, model: FittedModel, motions: Sequence[Trajectory], j: int) -> Factor:
        """The speed of joint j, from 0: a product of it with a function of something else."""
        own, speeds = j == self.number, tuple(m.v[:, j] for m in motions)
        kinds = [joint(s.joint) for s in model.refit.problem.model.arm.segments]
        noun = "Damping" if own else kinds[self.number].effort.capitalize()
        unit = kinds[j].coordinate_unit
        words = "times the speed" if own else f"times the speed of joint {j + 1}"
        return Factor(noun, words, f"dtheta{j + 1}", f"{unit}/s", speeds, brakes=own)

    def _direction(self, motions: Sequence[Trajectory]) -> Factor:
        """One forwards, minus one backwards, and between them near rest."""
        speeds = [m.v[:, self.number] for m in motions]
        pace = REVERSAL * float(np.sqrt(np.mean(np.concatenate(speeds) ** 2))) or 1.0
        along = tuple(np.tanh(v / pace) for v in speeds)
        formula = f"friction(theta{self.number + 1})"
        return Factor(
            "Friction", "times the sign of the speed", formula, "", along, formula, brakes=True
        )


@dataclass(frozen=True)
class TipTarget(ForceTarget):
    """A component of the force at the tip."""

    def choices(
        self, model: FittedModel, motions: Sequence[Trajectory]
    ) -> list[tuple[Variable, Factor]]:
        nothing = Factor("Force", "", "", "", ones(motions))
        tips = [m.tip() for m in motions]
        variables = [time_of(motions)]
        for i in (0, 1):
            title = f"place z{i + 1} of the tip"
            place, rate = (tuple(tip[d][:, i] for tip in tips) for d in (0, 1))
            variables.append(Variable(f"z{i + 1}", title, "m", place))
            variables.append(Variable(f"dz{i + 1}", f"rate of the {title}", "m/s", rate))
        return [(x, nothing) for x in variables if varies(x)]


@dataclass(frozen=True)
class ReadingTarget(Target):
    """A channel of a sensor, which reads more or less than there is."""

    name: str
    title: str
    unit: str
    number: int
    """Of the compared channels, from 0."""
    channels: tuple[int, ...]
    """Those of its sensor, from 0."""

    def choices(
        self, model: FittedModel, motions: Sequence[Trajectory]
    ) -> list[tuple[Variable, Factor]]:
        problem = model.refit.problem
        ideal = problem.residuals.predictor.readings(
            [(problem.vector, range(len(model.data.experiments)))]
        )[0]
        nothing = Factor("Error", "", "", "", tuple(np.ones(len(y)) for y in ideal))
        variables = [time_of(motions)]
        for k in self.channels:
            name, unit = model.data.experiments[0].channels[k]
            along = tuple(y[:, k] for y in ideal)
            variables.append(Variable(name, f"reading {name}", unit, along))
        return [(x, nothing) for x in variables if varies(x)]

    def responses(self, model: FittedModel, signals: Sequence[Series]) -> list[Series]:
        pairs = list(zip(model.data.experiments, model.data.weights, strict=True))
        return [
            tuple(self._change(e, w, x) for (e, w), x in zip(pairs, signal, strict=True))
            for signal in signals
        ]

    def _change(self, e: Prepared, weights: np.ndarray, signal: np.ndarray) -> np.ndarray:
        """(M, k): a signal that is added to the reading, behind logger and filters."""
        raw = np.zeros((len(signal), len(e.channels)))
        raw[:, self.number] = e.through_logger(self.name, signal)
        change = np.where(e.counted, e.processed_change(raw), 0.0)
        return np.asarray(e.standstill.removed_from(change) * weights)


def targets(model: FittedModel) -> tuple[Target, ...]:
    """Where a law of the model may act: forces first, then what is read beyond the drives."""
    arm, data = model.refit.problem.model.arm, model.data
    first, possible = data.experiments[0], readings(arm)
    at = {name: k for k, (name, _) in enumerate(first.channels)}
    shown = {
        name: sensor for name, (sensor, _) in possible.items()
        if name in at and not (data.rig.servo and sensor.kind in FOLLOWED)
    }  # fmt: skip
    found: list[Target] = list(force_targets(arm))
    for name, sensor in shown.items():
        beside = tuple(at[c.name] for c in sensor.channels(arm) if c.name in at)
        unit = first.channels[at[name]][1]
        found.append(ReadingTarget(name, f"the reading {name}", unit, at[name], beside))
    return tuple(found)


FOLLOWED = ("encoder", "torque")
"""Sensors that a virtual servo turns into motion: what they read is no sum any more."""


def force_targets(arm: Arm) -> tuple[ForceTarget, ...]:
    """All joints, then the components of the force at the tip."""
    joints = tuple(
        JointTarget(
            f"joint{k + 1}", f"joint {k + 1}", joint(segment.joint).effort_unit,
            Probe(acts=at_joint(k)), k,
        )
        for k, segment in enumerate(arm.segments)
    )  # fmt: skip
    if arm.joints == 1 and not any(arm.modes):
        return joints  # the tip is where the joint is
    tips = tuple(TipTarget(f"tip{i + 1}", f"the tip along z{i + 1}", "N", Probe(acts=at_tip(i)))
                 for i in (0, 1))  # fmt: skip
    return (*joints, *tips)
