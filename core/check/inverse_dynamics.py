"""Torques or currents compared with the inverse dynamics of the joint motion.

A joint's torque is a sum over all joints' accelerations, tau_k = sum_j T_kj + friction. Each part
gets its own gain: a wrong torque factor changes a row of gains, a wrong encoder a column. Otherwise
a torque is compared with the motion of its own joint.
"""

from __future__ import annotations

import numpy as np
import scipy

from ..check.gain_and_lag import (
    GAIN_EXPLAINED,
    LAG_EXPLAINED,
    LEAST_EXPLAINED,
    NEWTON,
    Relation,
    regress,
)
from ..check.link_bending import MOST, SMALL, LinkBending, LinkShape
from ..check.measured_recording import MeasuredRecording
from ..model import Model
from ..recording.channels import DRIVES, Role, role_of

PART = 0.1
"""Least share of a torque's variance for a part's gain to count."""
KNOWN = 5.0
"""Least standard deviations of a gain from zero."""


def loop_gains(recording: MeasuredRecording, shape: LinkShape) -> list[tuple[float, float, float]]:
    """(gain of the speed, gain of the torque over the stated 1 / lambda, share explained) of each
    velocity loop, theta'* = theta' + (tau + friction) / lambda. With a clock c times too slow a
    speed is c times too small, and a torque c^2 times."""
    links, model = LinkBending.of(recording), recording.model
    gains_ = getattr(getattr(model, "drive", None), "gains", None)
    if links is None or model is None or gains_ is None:
        return []
    names = model.drive.reference_channels(model.arm)
    if not recording.has(*names) or not all(role_of(n) is Role.SPEED for n in names):
        return []
    torques = links.torques(links.coordinates(shape, links.q))
    speed, dry = links.friction_inputs(links.q)
    inner = links.inner
    gains = []
    for k, name in enumerate(names):
        y = links.as_applied(links.channel(name))[inner]
        A = np.column_stack([speed[:, k], torques[:, k], dry[:, k], np.ones(len(speed))])[inner]
        part, _, explained = regress(A, y)
        gains.append((float(part[0]), float(part[1]) * gains_[k], explained))
    return gains


def torque_relations(
    recording: MeasuredRecording, model: Model, shape: LinkShape | None
) -> list[Relation]:
    """Relations of each torque to every joint's motion where its gain is determined, or else to
    its own joint's. `shape`: the links as they are, which must explain a torque, or none does;
    None: as stiff ones."""
    names, links = model.drive.reference_channels(model.arm), LinkBending.of(recording, most=np.inf)
    driven = all(role_of(n) in DRIVES for n in names) and recording.has(*names)
    if links is None or not driven:
        return _newton(recording, model)
    constants = getattr(model.drive, "torque_constants", None) or (1.0,) * len(names)
    if np.max(np.ptp(links.q[:, 1:], axis=0), initial=0.0) > SMALL:
        shape = None
    parts = links.torques_of_each(shape)
    speed, dry = links.friction_inputs(links.q)
    each: list[Relation] = []
    for k, (name, constant) in enumerate(zip(names, constants, strict=True)):
        y = links.as_applied(links.channel(name))[links.inner]
        A = np.column_stack([parts[:, k], speed[:, k], dry[:, k], np.ones(len(speed))])[links.inner]
        part, errors, explained = regress(A, y)
        large = np.var(part * A, axis=0) > PART * np.var(y)
        clear = explained > GAIN_EXPLAINED
        sure = [j for j in range(len(names)) if large[j] and abs(part[j]) > KNOWN * errors[j]]
        if shape is not None and not (clear and sure):
            each.append(Relation(name, (), 1.0, np.inf, 0.0, np.inf, 0.0, np.inf))
            continue
        each += [
            Relation(name, (f"theta{j + 1}",), float(part[j]) * constant, np.inf, 0.0, np.inf,
                     explained, NEWTON if clear else np.inf, step=recording.step)
            for j in sure
        ]  # fmt: skip
    return each or _newton(recording, model)


def _newton(recording: MeasuredRecording, model: Model) -> list[Relation]:
    """Relations of torque to acceleration of the same joint, friction free; for torque rigs."""
    newton_relations = []
    for k in range(model.arm.joints):
        angle = f"theta{k + 1}"
        for output in (f"u{k + 1}", f"i{k + 1}", f"deflection{k + 1}"):
            if not recording.has(output, angle) or recording.has(f"dtheta{k + 1}_ref"):
                continue
            relation = _inertial(recording, output, angle, _nominal(model, output, k))
            newton_relations += [relation] if relation else []
    return newton_relations


def _nominal(model: Model, output: str, k: int) -> float:
    """Apparent inertia of a straight rigid arm, per unit of torque or current; 0: unknown."""
    if role_of(output) is Role.DEFLECTION:
        return 0.0
    moved = model.arm.segments[k]
    inertia, reach = moved.hub_inertia + moved.rotor_inertia, 0.0
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
    if role_of(output) is Role.CURRENT:
        return inertia / constants[k] if constants else 0.0
    return inertia


CUT = 10.0
"""Hz: below the bending frequencies of laboratory arms, above a servo's motion."""


def _inertial(
    recording: MeasuredRecording, output: str, angle: str, nominal: float
) -> Relation | None:
    """The relation whose gain is the apparent inertia: only its sign and its change between
    recordings count."""
    dt = recording.step
    cut = min(CUT, 0.2 / dt)
    sections = scipy.signal.butter(2, cut, fs=1.0 / dt, output="sos")
    q = scipy.signal.sosfiltfilt(sections, recording.even(angle))
    y = scipy.signal.sosfiltfilt(sections, recording.even(output))
    v = np.gradient(q, dt)
    a = np.gradient(v, dt)
    dry = np.tanh(v / (0.05 * np.std(v) + 1e-12))
    columns = np.column_stack([a, v, dry, np.ones_like(v)])
    best, gain, share = _at_lag(columns, y, 0)
    lag = 0.0
    if best > LEAST_EXPLAINED:
        tried = {k: _at_lag(columns, y, k)[0] for k in range(-MOST_ROWS, MOST_ROWS + 1)}
        top = max(tried, key=lambda k: tried[k])
        lag = dt * (top + _vertex(tried, top))
        best, gain, share = _at_lag(columns, y, top)
    if best < LEAST_EXPLAINED or share < 0.1 or gain == 0:
        return None
    sign = -1.0 if role_of(output) is Role.DEFLECTION else 1.0
    gain = sign * gain / (nominal or abs(gain))
    tolerance = NEWTON if nominal else np.inf
    # Bending and friction shift what fits best by some samples, unless all is explained.
    lag = lag if best > LAG_EXPLAINED else np.inf
    return Relation(output, (angle,), gain, lag, 0.0, np.inf, best, tolerance, step=dt)


MOST_ROWS = 25
"""Largest lag between torque and motion, in samples."""


def _at_lag(columns: np.ndarray, y: np.ndarray, rows: int) -> tuple[float, float, float]:
    """(share explained, gain of the acceleration, its share) with y delayed by `rows` samples."""
    edge = max(len(y) // 20, MOST_ROWS + 1)
    inner = slice(edge, len(y) - edge, max(len(y) // MOST, 1))
    shifted = np.roll(y, -rows)[inner]
    chosen = columns[inner]
    part, _, explained = regress(chosen, shifted)
    share = float(np.var(part[0] * chosen[:, 0])) / max(float(np.var(shifted)), 1e-300)
    return explained, float(part[0]), share


def _vertex(tried: dict[int, float], top: int) -> float:
    """Position of the top of a parabola through the best three, between samples."""
    if top - 1 not in tried or top + 1 not in tried:
        return 0.0
    before, middle, after = tried[top - 1], tried[top], tried[top + 1]
    bend = before - 2.0 * middle + after
    return 0.5 * (before - after) / bend if bend < 0 else 0.0
