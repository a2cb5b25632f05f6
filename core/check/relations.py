"""What the channels of a recording say of each other: gain, lag and drift of pairs.

Three sources: the scenario's closed loop run with the recorded references, which predicts every
sensor; a reference and what follows it; and Newton's law between a joint's torque and its motion.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import signal

from core.check.bending import Shape
from core.check.inverse import gains
from core.check.measured import Measured
from core.model import Model
from core.sensors import sensors
from core.simulate.motion import Task, at_rest
from core.simulate.nonlinear import run
from core.trajectory import Trajectory

SUBSTEPS = 8
"""Per sample: the loop's motion within a per cent, which no check resolves."""
SMALL = 0.3
"""rad (m): below, the references' effects on a posture add up within a few per cent."""
LOOP, DIRECT, NEWTON = 0.25, 0.12, 1.1
"""Natural logarithm of a gain that is nobody's fault. LOOP: dry friction takes 10 %, a payload as
much (scenarios/mujoco); DIRECT: a real drive's current follows its reference within 7 %; NEWTON:
the apparent inertias of a bench are 1.5 to 2.5 times the nominal ones."""
WORTH = 0.5
"""Share of variance that must be explained before a gain means anything."""
MOST = 4000
"""Rows of a regression; more say nothing new."""
LAGS = 0.25
"""s, the longest delay sought."""


@dataclass(frozen=True)
class Relation:
    """`output` is `gain` times what `inputs` say it should be, `lag` later."""

    output: str
    inputs: tuple[str, ...]
    gain: float
    lag: float
    """s"""
    drift: float
    """s/s: by how much the lag grows."""
    drift_error: float
    """s/s, its standard deviation."""
    explained: float
    """Share of the output's variance."""
    room: float
    """|ln gain| that is nobody's fault; infinite where only the sign is known."""
    expected: np.ndarray | None = None
    """(M,) on the even clock, of the output."""
    swapped: float = 0.0
    """Share that the other joint's input explains."""
    step: float = 0.0
    """s, the sample time."""
    direct: float = 1.0
    """Share that its own input explains with the lag for which `swapped` is stated."""

    @property
    def key(self) -> tuple[str, tuple[str, ...]]:
        """By which two relations are the same: output and inputs."""
        return self.output, self.inputs

    @property
    def timeless(self) -> Relation:
        """Without the lag where that depends on dynamics which nobody knows."""
        if self.room == DIRECT:
            return self
        return replace(self, lag=np.inf, drift=0.0, drift_error=np.inf)


def relations(
    found: Measured,
    quick: bool = False,
    values: Mapping[str, float] | None = None,
    shape: Shape | None = None,
) -> tuple[Relation, ...]:
    """All that can be said; nothing where the arm is not known.

    Args:
        quick: Leaves out what each reference does by itself.
        values: Of parameters that the recordings show better than the scenario states them.
        shape: The links as the recordings show them.
    """
    made = [*_followed(found)]
    if found.model is not None:
        made += _loop(found, found.model, quick, values or {})
        made += _torques(found, found.model, shape)
    return tuple(made)


def _followed(found: Measured) -> list[Relation]:
    made = []
    for k in range(3):
        for output in (f"theta{k + 1}", f"i{k + 1}"):
            given, other = f"{output}_ref", f"{output[:-1]}{2 - k}_ref"
            if not found.has(output, given):
                continue
            x, y = found.even(given), found.even(output)
            both = k < 2 and found.has(other)
            swapped = share(found.even(other), y, found.step) if both else 0.0
            one = compare(output, (given,), y, [x - x[0]], found.step, DIRECT, swapped)
            if one:
                gain = _level(y, x, one, found.step) if output.startswith("theta") else one.gain
                made.append(replace(one, gain=gain, direct=share(x, y, found.step)))
    return made


def _level(y: np.ndarray, x: np.ndarray, one: Relation, dt: float) -> float:
    """The gain of places, not of speeds: what a servo settles at, however slowly it follows."""
    t = dt * np.arange(len(x))
    given = np.interp(t - one.lag, t, x)
    given = given - given.mean()
    size = float(np.sum(given**2))
    gain = float(np.sum(given * (y - y.mean()))) / size if size > 0 else 0.0
    return gain or one.gain


def compare(
    output: str, inputs: tuple[str, ...], y: np.ndarray, expected: Sequence[np.ndarray],
    dt: float, room: float, swapped: float = 0.0,
) -> Relation | None:  # fmt: skip
    """Regress a channel on what it should be: gains, lag and drift of the lag.

    Args:
        y: (M,) measured.
        expected: One (M,) per input.
        dt: s

    Returns:
        None where nothing is explained. The gain is that of the only input, or of their sum.
    """
    x = np.sum(expected, axis=0)
    if not (np.std(x) > 0 and np.std(y) > 0):
        return None
    lag, explained = _best_lag(y, x, dt)
    if explained < 0.02:
        return Relation(output, inputs, 1.0, 0.0, 0.0, np.inf, explained, room, x, swapped, dt)
    gain, lag, drift, error, explained = _refined(y, x, lag, dt)
    return Relation(output, inputs, gain, lag, drift, error, explained, room, x, swapped, dt)


def share(x: np.ndarray, y: np.ndarray, dt: float) -> float:
    """r^2 of two signals' moves at their best lag."""
    return _best_lag(y, x, dt)[1] if np.std(x) > 0 and np.std(y) > 0 else 0.0


SLOW = signal.butter(2, 0.2, output="sos")
"""Without the fastest tenth of a signal, where there is noise and no motion."""


def _smooth(x: np.ndarray) -> np.ndarray:
    return np.asarray(signal.sosfiltfilt(SLOW, x - x[0])) if len(x) > 20 else x


def _best_lag(y: np.ndarray, x: np.ndarray, dt: float) -> tuple[float, float]:
    """The lag (s) at which the moves of both agree best, and the share explained there."""
    a, b = np.diff(_smooth(x)), np.diff(_smooth(y))
    a, b = a - a.mean(), b - b.mean()
    most = min(int(LAGS / dt), len(a) // 4)
    whole = signal.correlate(b, a, mode="full", method="fft")
    middle = len(a) - 1
    around = whole[middle - most : middle + most + 1]
    size = float(np.sqrt(np.sum(a * a) * np.sum(b * b)))
    if size == 0:
        return 0.0, 0.0
    k = int(np.argmax(np.abs(around)))
    return (k - most) * dt, float(around[k] / size) ** 2


def _refined(
    y: np.ndarray, x: np.ndarray, lag: float, dt: float
) -> tuple[float, float, float, float, float]:
    """(gain, lag, drift, its deviation, share explained) by Gauss-Newton on the moves."""
    t = dt * np.arange(len(x))
    drift = 0.0
    xs, ys = _smooth(x), np.gradient(_smooth(y), dt)
    rate = np.gradient(xs, dt)
    gain, error, explained = 1.0, np.inf, 0.0
    for _ in range(6):
        when = t - lag - drift * (t - t[-1] / 2)
        inside = (when >= t[0]) & (when <= t[-1])
        p = np.interp(when, t, rate)
        slope = np.gradient(p, dt)
        columns = np.column_stack([p, -slope, -slope * (t - t[-1] / 2), np.ones_like(p)])[inside]
        part, *_ = np.linalg.lstsq(columns, ys[inside], rcond=None)
        rest = ys[inside] - columns @ part
        explained = 1.0 - float(np.var(rest) / max(np.var(ys[inside]), 1e-300))
        gain = float(part[0]) or 1.0
        # Neighbouring rests are alike: as many are independent as the smoothing leaves.
        spread = np.linalg.pinv(columns.T @ columns) * np.var(rest) * 10.0
        error = float(np.sqrt(max(spread[2, 2], 0.0)) / abs(gain))
        limit = 20.0 * dt
        lag += float(np.clip(part[1] / gain, -limit, limit))
        drift += float(np.clip(part[2] / gain, -0.02, 0.02))
        if abs(lag) > 2 * LAGS:
            break
    return gain, lag, drift, error, explained


def _loop(
    found: Measured, model: Model, quick: bool, values: Mapping[str, float]
) -> list[Relation]:
    """Every sensor against the scenario's closed loop under the recorded references."""
    references = model.drive.reference_channels(model.arm)
    if not all(r.endswith("_ref") and r.startswith(("dtheta", "theta")) for r in references):
        return []
    if not references or not found.has(*references):
        return []
    start = _posture(found, model)
    if start is None:
        return []
    signals = np.column_stack([found.even(r) for r in references])

    def predicted(given: np.ndarray) -> dict[str, np.ndarray] | None:
        return _predicted(model, found.grid, given, start, values)

    together = predicted(signals)
    if together is None:
        return []
    return _compared(found, model, references, signals, predicted, together, quick)


def _compared(found, model, references, signals, predicted, together, quick):  # type: ignore[no-untyped-def]
    names = [n for n in together if found.has(n)]
    joints = model.arm.joints
    moved = max((np.ptp(together[f"theta{k + 1}"]) for k in range(joints)), default=0.0)
    small = (
        not quick and moved < SMALL and joints > 1 and all(r.startswith("d") for r in references)
    )
    singles: list[dict[str, np.ndarray]] = []
    if small:
        for j in range(len(references)):
            alone = np.zeros_like(signals)
            alone[:, j] = signals[:, j]
            answer = predicted(alone)
            singles += [answer] if answer else []
    crossed = predicted(signals[:, ::-1]) if small else None
    made: list[Relation] = []
    for name in names:
        swapped = share(crossed[name], found.even(name), found.step) if crossed else 0.0
        y = found.even(name)
        whole = compare(name, references, y, [together[name]], found.step, LOOP, swapped)
        made += [whole] if whole else []
        if len(singles) == len(references):
            parts = [s[name] for s in singles]
            first = whole.lag if whole and whole.explained > WORTH else 0.0
            made += _by_reference(name, references, y, parts, found.step, first)
    return made


def _by_reference(
    name: str, references: Sequence[str], y: np.ndarray, parts: Sequence[np.ndarray], dt: float,
    lag: float,
) -> list[Relation]:  # fmt: skip
    """The gain of each reference in a channel, together."""
    ys = np.gradient(_smooth(y), dt)
    rates = [np.gradient(_smooth(p), dt) for p in parts]
    t = dt * np.arange(len(ys))
    lags = np.full(len(parts), lag)
    for _ in range(8):
        moved = [np.interp(t - lag, t, rate) for lag, rate in zip(lags, rates, strict=True)]
        slopes = [-np.gradient(m, dt) for m in moved]
        A = np.column_stack([*moved, *slopes, np.ones_like(ys)])
        part, *_ = np.linalg.lstsq(A, ys, rcond=None)
        gains = part[: len(parts)]
        late = part[len(parts) : -1] / np.where(gains == 0, 1.0, gains)
        lags = np.clip(lags + np.clip(late, -5 * dt, 5 * dt), -LAGS, LAGS)
    total = max(float(np.var(ys)), 1e-300)
    explained = 1.0 - float(np.var(ys - A @ part)) / total
    made = []
    for k, reference in enumerate(references):
        share = float(np.var(gains[k] * moved[k])) / total
        if share > 0.1 and explained > WORTH:
            made.append(
                Relation(
                    name, (reference,), float(gains[k]), float(lags[k]), 0.0, np.inf, explained,
                    LOOP, parts[k], step=dt,
                )
            )  # fmt: skip
    return made


def _posture(found: Measured, model: Model) -> np.ndarray | None:
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
    good = all(np.isfinite(channels[n]).all() for n in channels if n.startswith("theta"))
    return {n: v for n, v in channels.items() if np.isfinite(v).all()} if good else None


def _torques(found: Measured, model: Model, shape: Shape | None) -> list[Relation]:
    """Each torque against every joint's motion; where that cannot be, against its own joint's."""
    names = model.drive.reference_channels(model.arm)
    if not all(n[0] in "ui" for n in names):
        return _newton(found, model)
    constants = getattr(model.drive, "torque_constants", None) or (1.0,) * len(names)
    said = gains(found, names, shape)
    if not said:
        return _newton(found, model)
    scale = dict(zip(names, constants, strict=True))
    return [
        Relation(torque, (angle,), gain * scale[torque], np.inf, 0.0, np.inf, explained,
                 NEWTON if explained > RIGHT else np.inf, step=found.step)
        for torque, angle, gain, explained in said
    ]  # fmt: skip


def _newton(found: Measured, model: Model) -> list[Relation]:
    """Torque against acceleration of the same joint, friction left free; for torque rigs."""
    made = []
    for k in range(model.arm.joints):
        angle = f"theta{k + 1}"
        for output in (f"u{k + 1}", f"i{k + 1}", f"deflection{k + 1}"):
            if not found.has(output, angle) or found.has(f"dtheta{k + 1}_ref"):
                continue
            one = _inertial(found, output, angle, _nominal(model, output, k))
            made += [one] if one else []
    return made


def _nominal(model: Model, output: str, k: int) -> float:
    """The apparent inertia of a straight rigid arm, per unit of torque or current; 0: unknown."""
    if output.startswith("deflection"):
        return 0.0
    inertia, reach = model.arm.segments[k].hub_inertia, 0.0
    turning = model.arm.segments[k].joint == "revolute"
    for segment in model.arm.segments[k:]:
        if not turning:
            inertia += segment.mass + segment.tip_mass
            continue
        middle, end = reach + segment.length / 2, reach + segment.length
        inertia += segment.mass * (middle**2 + segment.length**2 / 12) + segment.tip_mass * end**2
        inertia += segment.tip_inertia
        reach = end
        if any(s.mount == "ground" for s in model.arm.segments[k + 1 :]):
            break
    constants = getattr(model.drive, "torque_constants", None)
    if output.startswith("i"):
        return inertia / constants[k] if constants else 0.0
    return inertia


CUT = 10.0
"""Hz: below the bending of laboratory arms, above a servo's motion."""


def _inertial(found: Measured, output: str, angle: str, nominal: float) -> Relation | None:
    """The gain is the apparent inertia: only its sign and its change between recordings count."""
    dt = found.step
    cut = min(CUT, 0.2 / dt)
    sections = signal.butter(2, cut, fs=1.0 / dt, output="sos")
    q = signal.sosfiltfilt(sections, found.even(angle))
    y = signal.sosfiltfilt(sections, found.even(output))
    v = np.gradient(q, dt)
    a = np.gradient(v, dt)
    dry = np.tanh(v / (0.05 * np.std(v) + 1e-12))
    columns = np.column_stack([a, v, dry, np.ones_like(v)])
    best, gain, share = _at_lag(columns, y, 0)
    lag = 0.0
    if best > WORTH:
        tried = {k: _at_lag(columns, y, k)[0] for k in range(-MOST_ROWS, MOST_ROWS + 1)}
        top = max(tried, key=lambda k: tried[k])
        lag = dt * (top + _vertex(tried, top))
        best, gain, share = _at_lag(columns, y, top)
    if best < WORTH or share < 0.1 or gain == 0:
        return None
    sign = -1.0 if output.startswith("deflection") else 1.0
    gain = sign * gain / (nominal or abs(gain))
    room = NEWTON if nominal else np.inf
    # Bending and friction shift what fits best by some samples, unless all is explained.
    lag = lag if best > ALL else np.inf
    return Relation(output, (angle,), gain, lag, 0.0, np.inf, best, room, step=dt)


RIGHT = 0.85
"""Share of a torque explained above which its gains count; below, only their signs do."""
ALL = 0.985
"""Share explained by a rigid joint with friction: EMPS 0.998, a bench with soft links 0.92."""
MOST_ROWS = 25
"""Lag sought between a torque and the motion, in samples."""


def _at_lag(columns: np.ndarray, y: np.ndarray, rows: int) -> tuple[float, float, float]:
    """(share explained, gain of the acceleration, its share) with y `rows` samples late."""
    edge = max(len(y) // 20, MOST_ROWS + 1)
    inner = slice(edge, len(y) - edge, max(len(y) // MOST, 1))
    seen = np.roll(y, -rows)[inner]
    chosen = columns[inner]
    part, *_ = np.linalg.lstsq(chosen, seen, rcond=None)
    total = max(float(np.var(seen)), 1e-300)
    explained = 1.0 - float(np.var(seen - chosen @ part)) / total
    return explained, float(part[0]), float(np.var(part[0] * chosen[:, 0])) / total


def _vertex(tried: dict[int, float], top: int) -> float:
    """Where between the samples a parabola through the best three has its top."""
    if top - 1 not in tried or top + 1 not in tried:
        return 0.0
    left, middle, right = tried[top - 1], tried[top], tried[top + 1]
    bend = left - 2.0 * middle + right
    return 0.5 * (left - right) / bend if bend < 0 else 0.0
