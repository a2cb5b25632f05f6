"""Where a law may act, and along which variables."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..arm.arm import Arm
from ..arm.chord import deflection_rows
from ..arm.joints import joint
from ..diagnose.fitted_model import FittedModel
from ..effects.own_reading import readings
from ..effects.per_segment import bending
from ..identify.prepared_recording import Prepared
from ..propose.probe import Probe, at_joint, at_tip, responses
from ..recording.inputs import INPUTS, TIME, input_signals
from ..trajectory import Trajectory

Series = tuple[np.ndarray, ...]
"""(N,) per recording."""

TEETH, FINE, COARSE = 61, 25, 7
"""Knots of a function: of a torque over a joint's own position, which may have teeth and poles, at
a second look, and at the first."""

QUICK = 0.001
"""rad (m): a bristle that turns over it is dry friction."""

REVERSAL = 0.02
"""Of a joint's rms speed: below it the direction of motion counts in part."""


class FreeConstant(NamedTuple):
    """A constant of a variable, which a refit may move."""

    name: str
    value: float
    unit: str
    lower: float
    upper: float


@dataclass(frozen=True)
class Variable:
    """What a law may depend on, along the fitted motions."""

    word: str
    """In a formula."""
    title: str
    unit: str
    along: Series
    knots: int = COARSE
    whole_turns: bool = False
    """Whether it is an angle, in which harmonics make sense."""
    place: bool = False
    """Whether friction and damping may depend on it: a position or the time."""
    elsewhere: bool = False
    """Whether it belongs to another joint than the law's, which friction() cannot see."""
    constants: tuple[FreeConstant, ...] = ()
    """What its word leaves open, in braces."""


@dataclass(frozen=True)
class Factor:
    """What a smooth function is multiplied by."""

    noun: str
    """What the product is: torque, friction, ..."""
    words: str
    """In words; empty: by nothing."""
    formula: str
    """In a formula, after a product sign; empty: nothing."""
    unit: str
    along: Series
    state: str = ""
    """What of it has a state, of which a formula may have one; empty: nothing."""
    brakes: bool = False
    """Whether a positive function acts against the motion."""


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
        arm, k = model.refit.parametrised.model.arm, self.number
        kind = joint(arm.segments[k].joint)
        nothing = Factor(kind.effort.capitalize(), "", "", "", _ones(motions))
        word, unit = f"theta{k + 1}", kind.coordinate_unit
        direction = self._direction(motions)
        bristle = f"hysteresis({word}, {QUICK})"
        seen_from_elsewhere = replace(direction, formula=bristle, state=bristle)
        speeds = tuple(m.v[:, k] for m in motions)
        speed = Factor("Damping", "the speed", f"d{word}", f"{unit}/s", speeds, brakes=True)
        chosen = []
        for x in _joint_variables(model, motions, k):
            coarse = replace(x, knots=COARSE)
            chosen.append((x, nothing))
            if x.place or x.word == f"u{k + 1}":
                chosen.append((coarse, seen_from_elsewhere if x.elsewhere else direction))
            if x.place:
                chosen.append((coarse, speed))
        return chosen + [(x, nothing) for x in _hysteresis(motions, k, unit)]

    def by_direction(
        self, model: FittedModel, motions: Sequence[Trajectory]
    ) -> list[tuple[Variable, Factor, Factor]]:
        direction = self._direction(motions)
        sides = []
        for name, sign in (("forwards", 1.0), ("backwards", -1.0)):
            along = tuple(0.5 * (1.0 + sign * d) for d in direction.along)
            formula = f"(1 {'+' if sign > 0.0 else '-'} {direction.formula})/2"
            side = replace(
                direction, words=f"one moving {name}", formula=formula, along=along,
                brakes=sign > 0.0,
            )  # fmt: skip
            sides.append(side)
        variables = _joint_variables(model, motions, self.number)
        return [
            (replace(x, knots=COARSE), sides[0], sides[1])
            for x in variables
            if x.place and not x.elsewhere
        ]

    def _direction(self, motions: Sequence[Trajectory]) -> Factor:
        """One forwards, minus one backwards, and between them near rest."""
        speeds = [m.v[:, self.number] for m in motions]
        pace = REVERSAL * float(np.sqrt(np.mean(np.concatenate(speeds) ** 2))) or 1.0
        along = tuple(np.tanh(v / pace) for v in speeds)
        formula = f"friction(theta{self.number + 1})"
        return Factor(
            "Friction", "the direction of motion", formula, "", along, formula, brakes=True
        )


@dataclass(frozen=True)
class TipTarget(ForceTarget):
    """A component of the force at the tip."""

    def choices(
        self, model: FittedModel, motions: Sequence[Trajectory]
    ) -> list[tuple[Variable, Factor]]:
        nothing = Factor("Force", "", "", "", _ones(motions))
        tips = [m.tip() for m in motions]
        variables = [_time(motions)]
        for i in (0, 1):
            title = f"place z{i + 1} of the tip"
            place, rate = (tuple(tip[d][:, i] for tip in tips) for d in (0, 1))
            variables.append(Variable(f"z{i + 1}", title, "m", place))
            variables.append(Variable(f"dz{i + 1}", f"rate of the {title}", "m/s", rate))
        return [(x, nothing) for x in variables if _varies(x)]


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
        h = model.refit.parametrised
        ideal = h.residuals.predictor.readings([(h.vector, range(len(model.data.experiments)))])[0]
        nothing = Factor("Error", "", "", "", tuple(np.ones(len(y)) for y in ideal))
        variables = [_time(motions)]
        for k in self.channels:
            name, unit = model.data.experiments[0].channels[k]
            along = tuple(y[:, k] for y in ideal)
            variables.append(Variable(name, f"reading {name}", unit, along))
        return [(x, nothing) for x in variables if _varies(x)]

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
        return np.asarray(e.without_standstill(change) * weights)


def targets(model: FittedModel) -> tuple[Target, ...]:
    """Where a law of the model may act: forces first, then what is read beyond the drives."""
    arm, data = model.refit.parametrised.model.arm, model.data
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


def _ones(motions: Sequence[Trajectory]) -> Series:
    return tuple(np.ones(len(m.time)) for m in motions)


def _time(motions: Sequence[Trajectory]) -> Variable:
    along = tuple(m.time - m.time[0] for m in motions)
    return Variable(TIME, "time since the recording began", "s", along, place=True)


def _joint_variables(model: FittedModel, motions: Sequence[Trajectory], k: int) -> list[Variable]:
    """Of a law at joint k, from 0: its own motion and torque first, then those of the others."""
    arm = model.refit.parametrised.model.arm
    variables = []
    for j in sorted(range(arm.joints), key=lambda j: j != k):
        kind, of = joint(arm.segments[j].joint), f"joint {j + 1}"
        unit, turns = kind.coordinate_unit, kind.coordinate_unit == "rad"
        places, rates = (tuple(x[:, j] for x in each) for each in
                         ([m.q for m in motions], [m.v for m in motions]))  # fmt: skip
        torque = tuple(m.torque[:, j] for m in motions)
        variables += [
            Variable(f"theta{j + 1}", f"position of {of}", unit, places,
                     TEETH if j == k else COARSE, turns, True, j != k),
            Variable(f"dtheta{j + 1}", f"speed of {of}", f"{unit}/s", rates),
            Variable(f"u{j + 1}", f"torque of drive {j + 1}", kind.effort_unit, torque),
        ]  # fmt: skip
    variables += [_time(motions), *_deflections(model, motions), *_inputs(model)]
    return [x for x in variables if _varies(x)]


WAYS = (0.02, 0.06, 0.2, 0.6)
"""Of a joint's range: ways over which a bristle turns."""

MOST_MOVED = 30.0
"""Factor by which a refit may move a way."""

SHARES = 5
"""Knots of a function of a bristle's share, from -1 to 1."""


def _hysteresis(motions: Sequence[Trajectory], k: int, unit: str) -> list[Variable]:
    """The shares of bristles that turn over different ways (core.effects.formula_functions)."""
    places = [m.q[:, k] for m in motions]
    span = max(float(np.ptp(x)) for x in places)
    title = f"direction of joint {k + 1}, which turns over a way"
    variables = []
    for way in (share * span for share in WAYS if span > 0.0):
        along = tuple(share_of_bristle(x, way) for x in places)
        free = FreeConstant("way", way, unit, way / MOST_MOVED, way * MOST_MOVED)
        word = f"hysteresis(theta{k + 1}, {{way}})"
        variables.append(Variable(word, title, "", along, SHARES, constants=(free,)))
    return variables


def share_of_bristle(x: np.ndarray, way: float) -> np.ndarray:
    """(N,) in [-1, 1] along a place (N,): exact between the samples of a steady motion."""
    share, u = np.zeros(len(x)), 0.0
    moves = np.diff(x)
    for i, (sign, kept) in enumerate(
        zip(np.sign(moves), np.exp(-np.abs(moves) / way), strict=True)
    ):
        u = sign + (u - sign) * kept
        share[i + 1] = u
    return share


def _deflections(model: FittedModel, motions: Sequence[Trajectory]) -> list[Variable]:
    arm, variables = model.refit.parametrised.model.arm, []
    for j in bending(arm):
        pairs = [(m, deflection_rows(arm, m.p)[j]) for m in motions]
        title = f"deflection of link {j + 1}"
        bent = tuple(m.q @ row for m, row in pairs)
        rate = tuple(m.v @ row for m, row in pairs)
        variables.append(Variable(f"delta{j + 1}", title, "m", bent))
        variables.append(Variable(f"ddelta{j + 1}", f"rate of the {title}", "m/s", rate))
    return variables


def _inputs(model: FittedModel) -> list[Variable]:
    """Columns that a person named as inputs, where all recordings have them."""
    recordings = [e.recording for e in model.data.experiments]
    variables = []
    for word in INPUTS:
        if word == TIME or not all(r.has(word) for r in recordings):
            continue
        each = [input_signals((word,), r.time, r.channels, r.name) for r in recordings]
        along = tuple(x[:, 0] for x in each if x is not None)
        variables.append(Variable(word, word, "", along, place=True))
    return variables


def _varies(x: Variable) -> bool:
    """Whether it has a range at all."""
    low, high = ends(x)
    return bool(high - low > 1e-9 * max(abs(low), abs(high), 1e-9))


def ends(x: Variable) -> tuple[float, float]:
    """Its least and its largest value over all recordings."""
    return min(float(a.min()) for a in x.along), max(float(a.max()) for a in x.along)
