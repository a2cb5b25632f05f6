"""Forces at joints whose motion a virtual servo prescribes: they change its torque only.

The servo follows the recorded joints whatever friction they have. So friction, ripples and torque
offsets need no simulation: they are evaluated along the motion and added to the torque. The
remaining simulation is smooth and never stiff.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy

from ..arm.arm import Structure
from ..arm.signatures import OPTIONS, kernel, matrix, vector
from ..bounded_cache import BoundedCache, digest
from ..compiler import njit, types
from ..drives.law import law_arrays
from ..drives.servo import averaged
from ..forces.compiled import compile_law
from ..forces.element import Element
from ..identify.prescribed_joint_motion import points_per_sample
from ..identify.prescribed_joints import is_prescribed
from ..model import Model, Numbers
from ..simulate.elements import call_element
from ..simulate.motion import Task
from ..trajectory import Trajectory

PARTS = 4
"""Parts of a sample at which forces are evaluated: a speed may reverse within a sample."""

NEWTON_STEPS = 50
"""Most Newton steps to a torque that depends on its own losses; piecewise linear, so two or three
are needed."""

LEAST_SLOPE = 1e-3
"""Slope below which a Newton step would diverge."""

TOLERANCE = 1e-9
"""N m or N: error of the torque at which Newton's method ends."""


def acts_at_prescribed_joint(model: Model, element: Element) -> bool:
    """Whether the element acts at one joint alone, and a servo prescribes that joint."""
    servo = model.steering is not None and model.level == "nonlinear"
    if not servo or element.at_tip or len(element.directions) != 1:
        return False
    direction = element.directions[0]
    return bool(np.count_nonzero(direction) == 1 and np.any(direction[: model.arm.joints]))


def simulated_part(model: Model, numbers: Numbers) -> Numbers:
    """The numbers without forces at prescribed joints; all of them if the drive has a limit, which
    those forces count against."""
    if np.any(np.isfinite(numbers.law.limit)):
        return numbers
    moving = tuple(e for e in numbers.elements if not acts_at_prescribed_joint(model, e))
    if len(moving) == len(numbers.elements):
        return numbers
    return numbers._replace(elements=moving)


def with_prescribed_forces(
    model: Model, numbers: Numbers, motion: Trajectory, inputs: np.ndarray | None = None
) -> Trajectory:
    """The motion with the torque that overcomes the forces at prescribed joints, too; `inputs`
    (N, inputs of the model) are those of its task. Friction sees a smoothed motion: encoder noise
    would reverse its sign at rest."""
    simulated = simulated_part(model, numbers)
    if simulated is numbers:
        return motion
    moving = {id(e) for e in simulated.elements}
    elements = [e for e in numbers.elements if id(e) not in moving]
    torque = motion.torque.copy()
    for e in sorted(
        elements, key=lambda element: bool(element.loads)
    ):  # losses see all other forces
        k = int(np.flatnonzero(e.directions[0])[0])
        signals = [torque[:, i] for i in e.loads]
        signals += [] if inputs is None else [inputs[:, numbers.inputs.index(n)] for n in e.inputs]
        if e.loads:
            given = torque[:, k].copy()
            torque[:, k] = _overcoming_torque(model, simulated, motion, e, k, given, signals)
        else:
            torque[:, k] += _force_along(model, simulated, motion, e, k, signals)
    return replace(motion, arm=model.arm, torque=torque)


def _force_along(
    model: Model, simulated: Numbers, motion: Trajectory, e: Element, k: int,
    signals: Sequence[np.ndarray],
) -> np.ndarray:  # fmt: skip
    """(N,) torque that overcomes one element at joint k (from 0); cached with the motion, since
    most parameters of a fit change neither."""
    key = (e.law, e.values, e.inputs, k, float(e.directions[0][k]), is_prescribed(model, simulated))
    nothing = np.zeros(len(motion.time))
    return motion.cached(
        key, lambda: _overcoming_torque(model, simulated, motion, e, k, nothing, signals)
    )


def _joint_motion(model: Model, simulated: Numbers, motion: Trajectory) -> np.ndarray:
    """(PARTS (N - 1) + 1, 2 joints): place and speed of the joints as friction sees them."""
    joints = model.arm.joints

    def compute() -> np.ndarray:
        place, speed = motion.q[:, :joints], motion.v[:, :joints]
        if not is_prescribed(model, simulated):
            return _spline_between(np.hstack([place, speed]))
        dt, servo = float(motion.time[1] - motion.time[0]), model.servo
        key = digest(place), dt, servo.hz, servo.band_hz
        return _JOINT_MOTIONS.get(
            key, lambda: _spline_between(np.hstack(servo.seen_by_friction(place, dt)))
        )

    return motion.cached(("seen", is_prescribed(model, simulated)), compute)


_JOINT_MOTIONS = BoundedCache[np.ndarray](32 * 2**20, lambda seen: seen.nbytes)
"""Bytes; of the joints' motion alone, which is as recorded for every model."""


def _overcoming_torque(
    model: Model, simulated: Numbers, motion: Trajectory, e: Element, k: int, torque: np.ndarray,
    signals: Sequence[np.ndarray],
) -> np.ndarray:  # fmt: skip
    """(N,) torque at joint k (from 0) that overcomes one element, added to the given torque;
    `signals` (N,) are what is written into its last parameters."""
    law, scale, joints = e.law, float(e.directions[0][k]), model.arm.joints
    motion_seen = _joint_motion(model, simulated, motion)
    dt = float(motion.time[1] - motion.time[0])
    x, v = (np.ascontiguousarray(scale * motion_seen[:, at]) for at in (k, joints + k))
    values = np.array([*e.values, 0.0], dtype=float)
    first = len(e.values) - e.written
    loaded_at = first + e.loads.index(k) if k in e.loads else -1
    out = np.zeros(law.size)
    address, whole = compile_law(law).address, _linear_between(torque)
    written = np.array([_linear_between(x) for x in signals]).reshape(len(signals), len(whole))
    as_it_is = bool(e.loads) or not is_prescribed(model, simulated)
    every = PARTS if as_it_is or not law.states else 1
    _along(
        address, len(law.states), loaded_at, x, v, dt / PARTS, values, first, written, scale,
        every, whole, out,
    )  # fmt: skip
    if as_it_is:
        return np.ascontiguousarray(whole[::PARTS])
    # As the rest of this torque is, which a loaded force already sees.
    if not law.states:
        return torque + averaged((whole[::PARTS] - torque)[:, None])[:, 0]
    weights = (PARTS - np.abs(np.arange(1 - PARTS, PARTS))) / PARTS**2
    added = scipy.ndimage.convolve1d(whole - _linear_between(torque), weights, mode="nearest")
    return torque + added[::PARTS]


def _linear_between(x: np.ndarray) -> np.ndarray:
    """(PARTS (N - 1) + 1,) straight between samples x (N,)."""
    return np.interp(np.arange(PARTS * (len(x) - 1) + 1) / PARTS, np.arange(len(x)), x)


def _spline_between(x: np.ndarray) -> np.ndarray:
    """(PARTS (N - 1) + 1, k) along the cubic splines through x (N, k), so that a fast vibration
    keeps its size; NaN where a sample is."""
    count = PARTS * (len(x) - 1) + 1
    if len(x) < 2 or not np.isfinite(x).all():
        return np.full((count, x.shape[1]), np.nan)
    spline = scipy.interpolate.CubicSpline(np.arange(len(x)), x)
    return np.asarray(spline(np.arange(count) / PARTS))


@njit(**OPTIONS)
def _force(address, x, v, w, values, loaded_at, u, out):  # type: ignore[no-untyped-def]
    """Of the element, N m or N, where the drive's torque is u."""
    if loaded_at >= 0:
        values[loaded_at] = u
    call_element(address, x, 0, v, 0, w, 0, values, 0, out)
    return out[0]


@kernel(
    types.void(
        types.int64, types.int64, types.int64, vector, vector, types.float64, vector, types.int64,
        matrix, types.float64, types.int64, vector, vector,
    ),
)  # fmt: skip
def _along(  # type: ignore[no-untyped-def]
    address, states, loaded_at, x, v, step, values, first, written, scale, every, torque, out
):
    """torque (N,) -= scale times the force along x, v (N,), at each `every`-th of them; a state
    (states is 0 or 1) begins at zero; written (W, N) goes into the values from the `first` on.

    The rate of a state is of first degree in it, so each step is exact at a constant speed.
    """
    w, at_x, at_v = np.zeros(1), np.zeros(1), np.zeros(1)
    for t in range(x.size):
        for i in range(written.shape[0]):
            values[first + i] = written[i, t]
        if t > 0 and states > 0:
            at_x[0], at_v[0] = 0.5 * (x[t - 1] + x[t]), 0.5 * (v[t - 1] + v[t])
            call_element(address, at_x, 0, at_v, 0, w, 0, values, 0, out)
            slope = out[6] * step
            grown = np.expm1(slope) / slope if abs(slope) > 1e-12 else 1.0
            w[0] += step * out[3] * grown
        if t % every:
            continue
        at_x[0], at_v[0] = x[t], v[t]
        given_torque = torque[t]
        u = given_torque
        for _ in range(NEWTON_STEPS):
            miss = (
                u - given_torque + scale * _force(address, at_x, at_v, w, values, loaded_at, u, out)
            )
            if abs(miss) <= TOLERANCE or loaded_at < 0:
                break
            h = 1e-6 * (1.0 + abs(u))
            above = _force(address, at_x, at_v, w, values, loaded_at, u + h, out)
            slope = (u + h - given_torque + scale * above - miss) / h
            u -= miss / slope if abs(slope) > LEAST_SLOPE else miss
        torque[t] = u if loaded_at >= 0 else u - miss


def motion_digest(model: Model, numbers: Numbers, task: Task, plain: Task) -> bytes:
    """Digest of all that determines a motion beyond the `plain` task of its recording."""
    hasher = hashlib.blake2b(digest_size=16)
    hasher.update(repr((hash(Structure.of(model.arm)), model.level)).encode())
    hasher.update(numbers.p.tobytes())
    if not is_prescribed(model, numbers):  # then no drive decides where the joints go
        for array in law_arrays(numbers.law):
            hasher.update(array.tobytes())
    for e in numbers.elements:
        hasher.update(repr((hash(e.law), e.values, e.at_tip, e.loads, e.inputs)).encode())
        for direction in e.directions:
            hasher.update(direction.tobytes())
    for name in ("references", "start", "schedule", "before", "inputs"):
        array = getattr(task, name)
        if array is not getattr(plain, name):  # most tasks share their long arrays with it
            hasher.update(name.encode())
            hasher.update(b"" if array is None else np.ascontiguousarray(array).tobytes())
    return hasher.digest()


def steps_between_points(model: Model, sample_time: float, steps: int) -> int:
    """Steps between the points of a model's prescribed motion, where its bare model takes `steps`
    between its own; samples are `sample_time` s apart."""
    points = servo_points_per_sample(model, sample_time)
    ratio = 1 if model.bare is None else servo_points_per_sample(model.bare, sample_time) // points
    return steps * max(ratio, 1)


def servo_points_per_sample(model: Model, sample_time: float) -> int:
    """Points per sample (of `sample_time` s) of the motion that a servo prescribes; else one."""
    prescribed = is_prescribed(model, simulated_part(model, model.numbers()))
    return points_per_sample(model, sample_time) if prescribed else 1
