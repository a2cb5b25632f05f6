"""What a law may depend on, along the motions, and what its function may be multiplied by.

A law acts along the true motion: the fitted one, moved by what it misses of the encoders. Where
friction holds a joint for a while, or a spring turns it round, the fitted motion, which knows no
such law, is elsewhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy

from ..arm.chord import deflection_rows
from ..arm.joints import joint
from ..effects.per_segment import bending
from ..estimate.fitted_model import FittedModel
from ..recording.inputs import INPUTS, TIME, input_signals
from ..recording.visible_band import visible_band
from ..trajectory import Trajectory

Series = tuple[np.ndarray, ...]
"""(N,) per recording."""

FINEST, FINE, COARSE = 61, 25, 7
"""Knots of a function: of a torque over a joint's own position, which may have teeth and poles, at
a second look, and at the first."""


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
    own_load: bool = False
    """Whether it is the torque of the law's own joint, on which friction may depend as well."""
    own_speed: bool = False
    """Whether it is the speed of the law's own joint."""


@dataclass(frozen=True)
class Factor:
    """What a smooth function is multiplied by."""

    noun: str
    """What the product is: torque, friction, ..."""
    words: str
    """Such as 'times the speed'; empty: by nothing."""
    formula: str
    """In a formula, after a product sign; empty: nothing."""
    unit: str
    along: Series
    state: str = ""
    """What of it has a state, of which a formula may have one; empty: nothing."""
    brakes: bool = False
    """Whether a positive function acts against the motion."""


def ones(motions: Sequence[Trajectory]) -> Series:
    """A factor that changes nothing."""
    return tuple(np.ones(len(m.time)) for m in motions)


def time_of(motions: Sequence[Trajectory]) -> Variable:
    """Since each recording began."""
    along = tuple(m.time - m.time[0] for m in motions)
    return Variable(TIME, "time since the recording began", "s", along, place=True)


def joint_variables(model: FittedModel, motions: Sequence[Trajectory], k: int) -> list[Variable]:
    """Of a law at joint k, from 0: its own motion and torque first, then those of the others."""
    arm = model.refit.problem.model.arm
    variables = []
    for j in sorted(range(arm.joints), key=lambda j: j != k):
        kind, of = joint(arm.segments[j].joint), f"joint {j + 1}"
        unit, turns = kind.coordinate_unit, kind.coordinate_unit == "rad"
        places, rates = (tuple(x[:, j] for x in each) for each in
                         ([m.q for m in motions], [m.v for m in motions]))  # fmt: skip
        torque = tuple(m.torque[:, j] for m in motions)
        variables += [
            Variable(f"theta{j + 1}", f"position of {of}", unit, places,
                     FINEST if j == k else COARSE, turns, True, j != k),
            Variable(f"dtheta{j + 1}", f"speed of {of}", f"{unit}/s", rates,
                     FINE if j == k else COARSE, own_speed=j == k),
            Variable(f"u{j + 1}", f"torque of drive {j + 1}", kind.effort_unit, torque,
                     own_load=j == k),
        ]  # fmt: skip
    variables += [time_of(motions), *_deflections(model, motions), *_inputs(model)]
    return [x for x in variables if varies(x)]


WAYS = (0.02, 0.06, 0.2, 0.6)
"""Of a joint's range: ways over which a bristle turns."""

MOST_MOVED = 30.0
"""Factor by which a refit may move a way."""

BRISTLE_KNOTS = 5
"""Knots of a function of a bristle's share, from -1 to 1."""


def bristle_shares(motions: Sequence[Trajectory], k: int, unit: str) -> list[Variable]:
    """The shares of bristles that turn over different ways (core.effects.formula_functions)."""
    places = [m.q[:, k] for m in motions]
    span = max(float(np.ptp(x)) for x in places)
    title = f"direction of joint {k + 1}, which turns over a way"
    variables = []
    for way in (share * span for share in WAYS if span > 0.0):
        along = tuple(share_of_bristle(x, way) for x in places)
        free = FreeConstant("way", way, unit, way / MOST_MOVED, way * MOST_MOVED)
        word = f"hysteresis(theta{k + 1}, {{way}})"
        variables.append(Variable(word, title, "", along, BRISTLE_KNOTS, constants=(free,)))
    return variables


def share_of_bristle(x: np.ndarray, way: float) -> np.ndarray:
    """(N,) in [-1, 1] along places x (N,), of a bristle (Dahl 1968) that turns over a `way` in the
    unit of x: exact between the samples of a steady motion."""
    share, u = np.zeros(len(x)), 0.0
    moves = np.diff(x)
    for i, (sign, kept) in enumerate(
        zip(np.sign(moves), np.exp(-np.abs(moves) / way), strict=True)
    ):
        u = sign + (u - sign) * kept
        share[i + 1] = u
    return share


def _deflections(model: FittedModel, motions: Sequence[Trajectory]) -> list[Variable]:
    arm, variables = model.refit.problem.model.arm, []
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
        variables.append(Variable(word, f"column {word}", "", along, place=True))
    return variables


def varies(x: Variable) -> bool:
    """Whether it has a range at all."""
    low, high = ends(x)
    return bool(high - low > 1e-9 * max(abs(low), abs(high), 1e-9))


def ends(x: Variable) -> tuple[float, float]:
    """Its least and its largest value over all recordings."""
    return min(float(a.min()) for a in x.along), max(float(a.max()) for a in x.along)


LOW_PASS_ORDER = 2
"""Of the low-pass, which runs forwards and backwards."""


def actual_motions(model: FittedModel) -> tuple[Trajectory, ...]:
    """The motion of each recording, with the joints where the encoders saw them, within the band
    where they see a motion; of a model at its minimum."""
    problem = model.refit.problem
    fitted = tuple(motion for motion, _, _ in problem.motions())
    if model.data.rig.servo:  # the joints follow the encoders already
        return fitted
    everything = range(len(fitted))
    readings = problem.residuals.predictor.readings([(problem.vector, everything)])[0]
    missed = [
        {
            name: e.recording[name] - y[:, i]
            for i, (name, _) in enumerate(e.channels)
            if e.kinds[i] == "encoder"
        }
        for e, y in zip(model.data.experiments, readings, strict=True)
    ]
    return _moved(fitted, missed)


def _moved(
    fitted: tuple[Trajectory, ...], missed: list[dict[str, np.ndarray]]
) -> tuple[Trajectory, ...]:
    places = [(m.q.copy(), m.v.copy()) for m in fitted]
    for j in range(fitted[0].arm.joints):
        errors = [each.get(f"theta{j + 1}") for each in missed]
        dts = [float(m.time[1] - m.time[0]) for m in fitted]
        known = [
            (x, dt) for x, dt in zip(errors, dts, strict=True)
            if x is not None and np.isfinite(x).all()
        ]  # fmt: skip
        band = visible_band(known) if len(known) == len(fitted) else None
        if band is None:
            continue
        for (q, v), (x, dt) in zip(places, known, strict=True):
            smooth = _below(x, dt, band.hz)
            q[:, j] += smooth
            v[:, j] += np.gradient(smooth, dt)
    return tuple(replace(m, q=q, v=v) for m, (q, v) in zip(fitted, places, strict=True))


def _below(x: np.ndarray, dt: float, hz: float) -> np.ndarray:
    """(N,) below a frequency, without delay."""
    share = 2.0 * hz * dt
    if share >= 1.0:
        return x
    sections = scipy.signal.butter(LOW_PASS_ORDER, share, output="sos")
    return np.asarray(scipy.signal.sosfiltfilt(sections, x))
