"""The joint motion that a virtual servo prescribes, through the encoders' readings.

The drive holds a torque u between samples, so joint accelerations jump at the samples by S^-1 times
the jump of u, where S = M_jj - M_je M_ee^-1 M_ej is the instantaneous inertia. That part is
integrated twice; the rest of the readings is smooth: a spline. A spline alone would excite a
vibration that switches in every third of its periods by some per cent. With few samples per
vibration, linear accelerations miss it (1 % at 1.5 rad a sample), so the motion is computed on a
finer grid (`points_per_sample`) by a spline of higher degree.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from ..arm.arm import Structure
from ..arm.signatures import addresses, dynamics_of, kernel, matrix, vector
from ..arm.slots import weighing
from ..bounded_cache import BoundedCache, digest
from ..drives.servo import FollowingServo
from ..identify.first_states import FREQUENCY_FACTOR
from ..lanes.algebra import factor_positive, substitute_positive
from ..model import Model, Numbers
from ..simulate.motion import Task

SWING = 0.5
"""rad per point of the finer grid for the arm's fastest vibration: a cubic spline misses 1e-4 of
its acceleration, and 1 % at 1.5 rad."""

PRESCRIBED_SWING = 1.0
"""The same with the joints prescribed: they take little part in it, and a cubic spline misses 0.2
%."""

FINEST = 8
"""Most points per sample: a phase of pi, the fastest that samples show, takes 6 of SWING."""

MOST_SWING = 2.26
"""rad per sample of a vibration, above which a spline of seventh degree misses a hundredth of it:
(x / (2 pi - x))^8."""


def points_per_sample(model: Model, sample_time: float) -> int:
    """Points per sample (of `sample_time` s) of the prescribed motion.

    Taken from the bare model, stretched out, at its own values, so that compared models use the
    same points. A vibration that no output shows needs none; but with its joints prescribed the arm
    vibrates more slowly, and that may show.
    """
    bare, servo = model.bare or model, model.steering
    if bare.arm.coordinates == bare.arm.joints:
        return 1
    key = id(bare), id(servo), sample_time
    return _POINTS.get(key, lambda: (bare, servo, _count_points(bare, servo, sample_time)))[2]


_POINTS = BoundedCache[tuple[Model, object, int]](64)
"""Needed at each simulation of a fit; both objects are kept, so that their ids stay unique."""


def _count_points(bare: Model, servo: FollowingServo | None, sample_time: float) -> int:
    joints = bare.arm.joints
    K, M = bare.stretched_matrices()
    band = np.inf if servo is None else servo.band_hz
    most = min(2.0 * np.pi * band * sample_time, FREQUENCY_FACTOR * np.pi)

    def fastest(K: np.ndarray, M: np.ndarray) -> float:
        swing = _phase_steps(K, M, sample_time)
        return float(np.max(swing[swing < most], initial=0.0))

    free, prescribed = fastest(K, M), fastest(K[joints:, joints:], M[joints:, joints:])
    points = max(free / SWING, prescribed / PRESCRIBED_SWING, 1.0)
    return int(np.clip(2 ** np.ceil(np.log2(points)), 1, FINEST))


def sampling_warning(model: Model, sample_time: float) -> str:
    """A warning if even the arm's slowest vibration is too fast for samples every `sample_time` s;
    else empty."""
    bare = model.bare or model
    K, M = bare.stretched_matrices()
    swings = _phase_steps(K, M, sample_time)
    vibrating = swings[swings > FREE_JOINT]
    slowest = float(vibrating.min(initial=np.inf))
    if not MOST_SWING < slowest < np.inf:
        return ""
    hz, rate = slowest / (2.0 * np.pi * sample_time), 1.0 / sample_time
    return (
        f"The arm vibrates at about {hz:.0f} Hz. {rate:.0f} samples per second hardly show that, "
        f"so the model's torques are wrong by some per cent; record at "
        f"{np.ceil(rate * slowest / MOST_SWING):.0f} Hz or more."
    )


FREE_JOINT = 1e-3
"""rad per sample: slower is a freely turning joint."""


def _phase_steps(K: np.ndarray, M: np.ndarray, sample_time: float) -> np.ndarray:
    """(n,) rad per sample of the vibrations of a stiffness and a mass matrix (n, n)."""
    if not len(K):
        return np.zeros(0)
    return np.asarray(
        np.sqrt(np.maximum(scipy.linalg.eigh(K, M, eigvals_only=True), 0.0)) * sample_time
    )


AVERAGE = 32
"""Samples of the mean that is subtracted from the held acceleration, so that its integral stays
small; the mean is linear between samples and does not jump."""


DEGREE = 7
"""Degree of the spline for a finer grid; at 1.5 rad per sample it misses less than the jumps."""


UNKNOWN_END = 4
"""Samples at an end where a spline of that degree misses vibrations: at 1.7 rad per sample all of
the torque at the last but one, a sixth of that each sample before."""


def unknown_ends(model: Model, task: Task) -> tuple[int, int]:
    """(first, last) samples at which the torque along prescribed joints is unknown: an end has no
    second difference, and the drive's earlier torque is unknown. A start at rest is known."""
    seldom = points_per_sample(model, task.sample_time) > 1
    return UNKNOWN_END if seldom and task.before is None else 1, UNKNOWN_END if seldom else 1


class PrescribedMotion(NamedTuple):
    """A prescribed motion of the joints, (finer (L + N - 1) + 1, joints) each, of which the first
    L = `lead` samples lie before the recording."""

    place: np.ndarray
    speed: np.ndarray
    straight: np.ndarray
    """Part of the acceleration that runs straight between samples."""
    held: np.ndarray
    """Part that is held from each sample to the next."""
    lead: int
    finer: int
    """Points per sample."""


def prescribed_motion(model: Model, numbers: Numbers, task: Task) -> PrescribedMotion:
    """The motion through the encoders' readings; with the time before the recording if it begins at
    rest and nothing is known of the arm's first state."""
    joints, n = model.arm.joints, model.arm.coordinates
    starts_moving = np.any(task.start[joints:n]) or np.any(task.start[n + joints : 2 * n])
    lead = 0 if task.before is None or starts_moving else len(task.before)
    finer = points_per_sample(model, task.sample_time)
    law, weight = numbers.law, weighing(numbers.p, joints).tobytes()
    along = law.R.tobytes(), law.references, lead, finer, task.sample_time
    key = id(task.references), id(task.before), Structure.of(model.arm), weight, along
    return _BY_TASK.get(
        key, lambda: _TaskMotion(task, _new_motion(model, numbers, task, lead, finer))
    ).motion


def _new_motion(
    model: Model, numbers: Numbers, task: Task, lead: int, finer: int
) -> PrescribedMotion:
    """The motion, computed and cached."""
    joints = model.arm.joints
    place = task.references[:, -2 * joints : -joints]
    whole = np.vstack([task.before, place]) if lead and task.before is not None else place
    nothing = np.full((finer * (len(whole) - 1) + 1, joints), np.nan)
    not_finite = PrescribedMotion(nothing, nothing, nothing, nothing, lead, finer)
    if not np.isfinite(whole).all():
        return not_finite
    at_once = _held_acceleration(model, numbers, task, whole, lead)
    dt = task.sample_time
    key = digest(whole, at_once), lead, finer, dt
    return _MOTIONS.get(key, lambda: _motion_through(whole, at_once, lead, finer, dt))


CAPACITY = 64 * 2**20
"""Bytes: some dozen recordings of ten thousand samples, each at a few values of a parameter. A
number of motions would be wrong for short or long recordings."""

_MOTIONS = BoundedCache[PrescribedMotion](
    CAPACITY, lambda motion: sum(part.nbytes for part in motion[:4])
)
"""Most parameters of a fit do not change a motion, and splines cost more than simulating a small
arm along them."""


class _TaskMotion(NamedTuple):
    """A task, kept so that the ids of its arrays stay unique, and its motion."""

    task: Task
    motion: PrescribedMotion


_BY_TASK = BoundedCache[_TaskMotion](
    CAPACITY, lambda one: one.task.references.nbytes + sum(part.nbytes for part in one.motion[:4])
)
"""By array identity: hashing them costs a third of a simulation."""


def _motion_through(
    whole: np.ndarray, at_once: np.ndarray, lead: int, finer: int, sample_time: float
) -> PrescribedMotion:
    """The motion through positions (L + N, joints); `at_once` (L + N, joints) is the held part of
    the acceleration."""
    mean = scipy.ndimage.uniform_filter1d(at_once, AVERAGE, axis=0, mode="nearest")
    at_once, mean = _on_finer_grid(at_once, mean, finer)
    dt = sample_time / finer
    jumping, speed = _integrated(at_once, mean, dt)
    # At rest there is neither speed nor acceleration; what they are at other ends nobody knows.
    flat = (mean[0] - at_once[0], (mean[1] - mean[0]) / dt) if lead else None
    smooth = _fine_spline(whole - jumping[::finer], finer, dt, flat)
    # A speed at the start, read out of the first samples' noise, would shake the arm to the end.
    begin = "not-a-knot" if flat is None else (1, np.zeros_like(flat[0]))
    spline = scipy.interpolate.CubicSpline(
        np.arange(len(smooth)) * dt, smooth, bc_type=(begin, "not-a-knot")
    )
    straight = spline(spline.x, 2) - mean
    positions = smooth + jumping
    positions[::finer] = whole
    return PrescribedMotion(positions, spline(spline.x, 1) + speed, straight, at_once, lead, finer)


def _on_finer_grid(
    constant: np.ndarray, mean: np.ndarray, finer: int
) -> tuple[np.ndarray, np.ndarray]:
    """Both (N, joints) at `finer` points per sample: constant and linear between samples."""
    at = np.arange(finer * (len(constant) - 1) + 1) / finer
    straight = [np.interp(at, np.arange(len(mean)), column) for column in mean.T]
    return constant[at.astype(int)], np.column_stack(straight)


def _fine_spline(
    x: np.ndarray, finer: int, dt: float, flat: tuple[np.ndarray, np.ndarray] | None
) -> np.ndarray:
    """Smooth x (N, k) at `finer` points per sample, dt s apart; `flat`: second and third derivative
    of a start without speed."""
    if finer == 1:
        return x.copy()
    t, half = np.arange(len(x)) * (finer * dt), (DEGREE - 1) // 2
    at = np.arange(finer * (len(x) - 1) + 1) * dt
    if len(x) <= 2 * DEGREE:
        return np.asarray(scipy.interpolate.CubicSpline(t, x)(at))
    begin = None if flat is None else [(1, np.zeros_like(flat[0])), (2, flat[0]), (3, flat[1])]
    inner = t[1 + (half if begin is None else 0) : -1 - half]
    knots = np.concatenate([np.repeat(t[0], DEGREE + 1), inner, np.repeat(t[-1], DEGREE + 1)])
    return np.asarray(scipy.interpolate.make_interp_spline(t, x, DEGREE, knots, (begin, None))(at))


def _held_acceleration(
    model: Model, numbers: Numbers, task: Task, place: np.ndarray, lead: int
) -> np.ndarray:
    """(L + N, joints): instantaneous joint acceleration by the drive's torque."""
    joints, n = place.shape[1], model.arm.coordinates
    if model.servo.is_smoothed(task.sample_time):
        return np.zeros_like(place)
    torque = model.servo.jumps(numbers.law, task.references)
    if n == joints or not np.any(np.diff(torque, axis=0)) or not np.isfinite(torque).all():
        return np.zeros_like(place)
    q = np.zeros((len(torque), n))
    q[:, :joints] = place[lead:]
    key = Structure.of(model.arm), digest(weighing(numbers.p, joints), torque, place[lead:])
    acceleration = _ACCELERATIONS.get(
        key,
        lambda: _instant_acceleration(
            model.compiled.addresses, q, numbers.p, np.ascontiguousarray(torque)
        ),
    )
    if not np.isfinite(acceleration).all():  # sizes so far off that no mass matrix is left
        return np.zeros_like(place)
    if not lead:
        return acceleration
    # From rest: the first step says how much of the first torque made the joint move.
    first = 2.0 * (place[lead + 1] - place[lead]) / task.sample_time**2
    moves = np.clip(first, np.minimum(acceleration[0], 0.0), np.maximum(acceleration[0], 0.0))
    return np.vstack([np.repeat((acceleration[0] - moves)[None], lead, axis=0), acceleration])


_ACCELERATIONS = BoundedCache[np.ndarray](CAPACITY, lambda found: found.nbytes)
"""Stiffnesses, friction and sensors do not change it."""


def _integrated(
    acceleration: np.ndarray, mean: np.ndarray, dt: float
) -> tuple[np.ndarray, np.ndarray]:
    """Places and speeds (N, joints) of `acceleration` (N, joints) minus `mean` (N, joints), which
    is linear between samples."""
    a, b = acceleration[:-1] - mean[:-1], acceleration[:-1] - mean[1:]
    nothing = np.zeros((1, acceleration.shape[1]))
    speed = np.vstack([nothing, np.cumsum(0.5 * (a + b) * dt, axis=0)])
    steps = speed[:-1] * dt + (2.0 * a + b) * dt**2 / 6.0
    return np.vstack([nothing, np.cumsum(steps, axis=0)]), speed


@kernel(matrix(addresses, matrix, vector, matrix))
def _instant_acceleration(arm, q, p, torque):  # type: ignore[no-untyped-def]
    """(N, nj) instantaneous accelerations by torques (N, nj) at positions q (N, n)."""
    (N, n), dynamics = q.shape, dynamics_of(arm)
    nj = torque.shape[1]
    M, f, still = np.empty(n * n), np.empty(n), np.zeros(n)
    accelerations = np.empty((N, nj))
    for t in range(N):
        dynamics(q[t], still, p, M, f)
        for i in range(n):
            f[i] = torque[t, i] if i < nj else 0.0
        factor_positive(M, n)
        substitute_positive(M, n, f)
        for i in range(nj):
            accelerations[t, i] = f[i]
    return accelerations
