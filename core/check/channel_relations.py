"""What the channels of a recording say of each other, as pairs with gain, lag and drift.

Three sources: the scenario's closed loop run with the recorded references, which predicts every
sensor; a reference and what follows it; and Newton's law between a joint's torque and its motion.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..check.gain_and_lag import DIRECT, LEAST_EXPLAINED, LOOP, Relation, fit_gains_and_lags, relate
from ..check.inverse_dynamics import torque_relations
from ..check.link_bending import LinkShape
from ..check.measured_recording import MeasuredRecording
from ..model import Model
from ..recording.channels import Role, is_reference, role_of
from ..sensors import sensors
from ..simulate.batch import run
from ..simulate.motion import Task, at_rest
from ..trajectory import Trajectory

SUBSTEPS = 8
"""Per sample: the loop's motion within a per cent, which no check resolves."""
SMALL = 0.3
"""rad (m): below, the references' effects on a posture add up within a few per cent."""


def relations(
    found: MeasuredRecording, quick: bool = False, shape: LinkShape | None = None
) -> tuple[Relation, ...]:
    """All that can be said; nothing where the arm is not known.

    Args:
        quick: Leaves out what each reference does by itself.
        shape: The links as the recordings show them.
    """
    made = [*_servos(found)]
    if found.model is not None:
        made += _loop(found, found.model, quick)
        made += torque_relations(found, found.model, shape)
    return tuple(made)


def _servos(found: MeasuredRecording) -> list[Relation]:
    made = []
    for output in found.names("theta#", "i#"):
        given = f"{output}_ref"
        if not found.has(given):
            continue
        x, y = found.even(given), found.even(output)
        one = relate(output, (given,), y, [x - x[0]], found.step, DIRECT)
        if one:
            gain = _level(y, x, one, found.step) if role_of(output) is Role.PLACE else one.gain
            made.append(replace(one, gain=gain))
    return made


def _level(y: np.ndarray, x: np.ndarray, one: Relation, dt: float) -> float:
    """The gain of places, not of speeds: what a servo settles at, however slowly it follows."""
    t = dt * np.arange(len(x))
    given = np.interp(t - one.lag, t, x)
    given = given - given.mean()
    size = float(np.sum(given**2))
    gain = float(np.sum(given * (y - y.mean()))) / size if size > 0 else 0.0
    return gain or one.gain


def _loop(found: MeasuredRecording, model: Model, quick: bool) -> list[Relation]:
    """Every sensor against the scenario's closed loop under the recorded references."""
    references = model.drive.reference_channels(model.arm)
    if not all(is_reference(r) and role_of(r) in (Role.PLACE, Role.SPEED) for r in references):
        return []
    if not references or not found.has(*references):
        return []
    start = _posture(found, model)
    if start is None:
        return []
    signals = np.column_stack([found.even(r) for r in references])

    def predicted(given: np.ndarray) -> Mapping[str, np.ndarray] | None:
        values = tuple(found.values.items())
        key = (id(model), values, found.step, start.tobytes(), hash(given.tobytes()))
        if key not in found.answers:
            answer = _predicted(model, found.grid, given, start, found.values)
            found.answers[key] = model, answer  # a model that is kept keeps its id
        return found.answers[key][1]

    together = predicted(signals)
    if together is None:
        return []
    return _compared(found, model, references, signals, predicted, together, quick)


def _compared(found, model, references, signals, predicted, together, quick):  # type: ignore[no-untyped-def]
    names = [n for n in together if found.has(n)]
    joints = model.arm.joints
    moved = max((np.ptp(together[f"theta{k + 1}"]) for k in range(joints)), default=0.0)
    small = (
        not quick
        and moved < SMALL
        and joints > 1
        and all(role_of(r) is Role.SPEED for r in references)
    )
    singles: list[dict[str, np.ndarray]] = []
    if small:
        for j in range(len(references)):
            alone = np.zeros_like(signals)
            alone[:, j] = signals[:, j]
            answer = predicted(alone)
            singles += [answer] if answer else []
    made: list[Relation] = []
    for name in names:
        y = found.even(name)
        whole = relate(name, references, y, [together[name]], found.step, LOOP)
        made += [whole] if whole else []
        if len(singles) == len(references):
            parts = [s[name] for s in singles]
            first = whole.lag if whole and whole.explained > LEAST_EXPLAINED else 0.0
            made += _by_reference(name, references, y, parts, found.step, first)
    return made


def _by_reference(
    name: str, references: Sequence[str], y: np.ndarray, parts: Sequence[np.ndarray], dt: float,
    lag: float,
) -> list[Relation]:  # fmt: skip
    """The gain of each reference in a channel, together."""
    one = fit_gains_and_lags(y, parts, dt, lag)
    return [
        Relation(name, (reference,), float(gain), float(late), 0.0, np.inf, one.explained, LOOP,
                 part, step=dt)
        for reference, gain, late, share, part in zip(
            references, one.gains, one.lags, one.shares, parts, strict=True
        )
        if share > 0.1 and one.explained > LEAST_EXPLAINED
    ]  # fmt: skip


def _posture(found: MeasuredRecording, model: Model) -> np.ndarray | None:
    names = [f"theta{k + 1}" for k in range(model.arm.joints)]
    return np.array([found.even(n)[0] for n in names]) if found.has(*names) else None


def _predicted(
    model: Model, time: np.ndarray, signals: np.ndarray, joints: np.ndarray,
    values: Mapping[str, float],
) -> dict[str, np.ndarray] | None:  # fmt: skip
    """Channels (M,) of the loop's motion; None where it runs away."""
    numbers = model.numbers(values)
    start = at_rest(joints, model.arm.coordinates, numbers.law.states)
    task = Task(time, signals, start, start[None, : model.arm.coordinates])
    try:
        with np.errstate(all="ignore"):
            motion = run(model, numbers, task, SUBSTEPS)
            return _measured(model, motion)
    except (ValueError, ArithmeticError, np.linalg.LinAlgError):
        return None


def _measured(model: Model, motion: Trajectory) -> dict[str, np.ndarray] | None:
    channels: dict[str, np.ndarray] = {}
    for kind, sensor in sensors().items():
        if kind in ("y", "ydot") and not motion.arm.two_revolute:
            continue
        values = np.array(sensor.measure(motion))
        for k, channel in enumerate(sensor.channels(motion.arm)):
            channels[channel.name] = values[:, k]
    good = all(np.isfinite(channels[n]).all() for n in channels if role_of(n) is Role.PLACE)
    return {n: v for n, v in channels.items() if np.isfinite(v).all()} if good else None
