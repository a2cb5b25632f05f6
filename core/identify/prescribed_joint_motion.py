"""The motion along which a virtual servo leads the joints: through what the encoders say.

Between the samples the joints move as the drive makes them: it holds a torque u from one sample to
the next, so their acceleration jumps at the samples by S^-1 times the jump of u, where
S = M_jj - M_je M_ee^-1 M_ej is what a joint weighs at once. That part is integrated twice, and what
the encoders say beyond it is smooth: a spline. Without the jumps, a spline through a motion that
switches in every third period of a vibration drives that vibration by some per cent. Where few
samples fall on a vibration, straight accelerations between them miss it (1 % at 1.5 rad a sample),
so the motion is led on a finer grid (`points_per_sample`), along a spline of higher degree.
"""

from __future__ import annotations

import hashlib
from typing import NamedTuple

import numpy as np
import scipy

from ..arm.arm import Structure
from ..arm.signatures import DYNAMICS, kernel, matrix, vector
from ..arm.slots import weighing
from ..bounded_cache import BoundedCache
from ..drives.servo import FollowingServo
from ..lanes.algebra import factor_positive, substitute_positive
from ..model import Model, Numbers
from ..simulate.motion import Task

SWING = 0.5
"""rad that the arm's fastest vibration may swing on from one point of the finer grid to the next: a
cubic spline through these misses 1e-4 of its acceleration, and 1 % at 1.5 rad."""

PRESCRIBED_SWING = 1.0
"""The same of its vibration with the joints led, where the free one is not compared: the joints
take little part in it, and a cubic spline misses 0.2 % of its acceleration."""

FINEST = 8
"""Points per sample: what swings on by pi, as fast as samples can show, takes 6 of SWING."""

FREQUENCY_FACTOR = 2.0
"""Factor by which a frequency may be wrong at the start, where a stiffness is so four times."""

MOST_SWING = 2.26
"""rad that a vibration swings on from one sample to the next, beyond which a spline of seventh
degree misses a hundredth of it: (x / (2 pi - x))^8."""


def points_per_sample(model: Model, sample_time: float) -> int:
    """Points per sample, which lasts `sample_time` s, along which the joints are led.

    Of the bare model stretched out, at its own values: models that are compared, the two ends of a
    difference and all recordings are led along the same points. A vibration that no compared
    output shows needs none; but with its joints led the arm swings more slowly than when they are
    free, and what it then does shows although the free vibration does not.
    """
    bare, servo = model.bare or model, model.steering
    if bare.arm.coordinates == bare.arm.joints:
        return 1
    key = id(bare), id(servo), sample_time
    return _POINTS.get(key, lambda: (bare, servo, _count_points(bare, servo, sample_time)))[2]


_POINTS = BoundedCache[tuple[Model, object, int]](64)
"""Asked for at each simulation of a fit; both objects are kept, so that their identities stay
theirs."""


def _count_points(bare: Model, servo: FollowingServo | None, sample_time: float) -> int:
    joints = bare.arm.joints
    K, M = _matrices(bare)
    band = np.inf if servo is None else servo.band_hz
    most = min(2.0 * np.pi * band * sample_time, FREQUENCY_FACTOR * np.pi)

    def fastest(K: np.ndarray, M: np.ndarray) -> float:
        swing = _phase_steps(K, M, sample_time)
        return float(np.max(swing[swing < most], initial=0.0))

    free, led = fastest(K, M), fastest(K[joints:, joints:], M[joints:, joints:])
    points = max(free / SWING, led / PRESCRIBED_SWING, 1.0)
    return int(np.clip(2 ** np.ceil(np.log2(points)), 1, FINEST))


def sampling_warning(model: Model, sample_time: float) -> str:
    """A sentence where even the arm's slowest vibration is too fast for the samples, s apart, along
    which its joints are led; empty where they show it."""
    bare = model.bare or model
    K, M = _matrices(bare)
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
"""rad per sample: slower is a joint that turns freely."""


def _matrices(bare: Model) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and mass (n, n) of the arm stretched out, at its own values."""
    n, p = bare.arm.coordinates, bare.numbers().p
    K, _ = bare.compiled.linear_matrices(np.zeros(n), p)
    M = bare.compiled.mass_matrix(np.zeros(n), p)
    return 0.5 * (K + K.T), 0.5 * (M + M.T)


def _phase_steps(K: np.ndarray, M: np.ndarray, sample_time: float) -> np.ndarray:
    """(n,) rad per sample of the vibrations of a stiffness and a mass (n, n)."""
    if not len(K):
        return np.zeros(0)
    return np.asarray(
        np.sqrt(np.maximum(scipy.linalg.eigh(K, M, eigvals_only=True), 0.0)) * sample_time
    )


AVERAGE = 32
"""Samples over which a mean is taken off the held acceleration, so that its integral stays small
beside the places; the mean runs straight between samples and makes no jump."""


DEGREE = 7
"""Of the spline from which a finer grid is read; at 1.5 rad per sample it misses less of an
acceleration than the jumps that no spline follows."""


UNKNOWN_END = 4
"""Samples at an end of a recording where a spline of that degree misses what vibrates: at 1.7 rad
per sample all of the torque at the last but one, a sixth of that each sample before."""


def unknown_ends(model: Model, task: Task) -> tuple[int, int]:
    """Samples at the beginning and at the end of a recording of which the torque along the led
    joints is not known: an end has no second difference, and what the drive held before it nobody
    knows. What begins at rest has a known end."""
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
    """Through what the encoders say; with the time before the recording where it begins at rest and
    nothing is known of what the arm does at the first sample."""
    joints, n = model.arm.joints, model.arm.coordinates
    known = np.any(task.start[joints:n]) or np.any(task.start[n + joints : 2 * n])
    lead = 0 if task.before is None or known else len(task.before)
    finer = points_per_sample(model, task.sample_time)
    law, weight = numbers.law, weighing(numbers.p, joints).tobytes()
    along = law.R.tobytes(), law.references, lead, finer, task.sample_time
    key = id(task.references), id(task.before), Structure.of(model.arm), weight, along
    return _BY_TASK.get(
        key, lambda: _TaskMotion(task, _new_motion(model, numbers, task, lead, finer))
    ).led


def _new_motion(
    model: Model, numbers: Numbers, task: Task, lead: int, finer: int
) -> PrescribedMotion:
    """The same, of recordings that were not led along so before."""
    joints = model.arm.joints
    place = task.references[:, -2 * joints : -joints]
    whole = np.vstack([task.before, place]) if lead and task.before is not None else place
    nothing = np.full((finer * (len(whole) - 1) + 1, joints), np.nan)
    astray = PrescribedMotion(nothing, nothing, nothing, nothing, lead, finer)
    if not np.isfinite(whole).all():
        return astray
    at_once = _held_acceleration(model, numbers, task, whole, lead)
    dt = task.sample_time
    key = _digest(whole, at_once), lead, finer, dt
    return _MOTIONS.get(key, lambda: _motion_through(whole, at_once, lead, finer, dt))


def _digest(*arrays: np.ndarray) -> bytes:
    found = hashlib.blake2b(digest_size=16)
    for array in arrays:
        found.update(np.ascontiguousarray(array).tobytes())
    return found.digest()


CAPACITY = 64 * 2**20
"""Bytes: some dozen recordings of ten thousand samples, each at a few values of a parameter. A
number of motions would be too few for many short recordings, which then push each other out, and
too many for long ones."""

_MOTIONS = BoundedCache[PrescribedMotion](
    CAPACITY, lambda led: sum(part.nbytes for part in led[:4])
)
"""Most parameters of a fit leave a motion as it is, and splines cost more than simulating an arm of
few coordinates along them."""


class _TaskMotion(NamedTuple):
    """A task, kept so that the identities of its arrays stay theirs, and the motion of it."""

    task: Task
    led: PrescribedMotion


_BY_TASK = BoundedCache[_TaskMotion](
    CAPACITY, lambda one: one.task.references.nbytes + sum(part.nbytes for part in one.led[:4])
)
"""By the arrays themselves: to read them through for what they say costs a third of simulating
along them."""


def _motion_through(
    whole: np.ndarray,
    at_once: np.ndarray,
    lead: int,
    finer: int,
    sample_time: float,
) -> PrescribedMotion:
    """The motion through places (L + N, joints); `at_once` (L + N, joints) is the part of its
    acceleration that is held between samples."""
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
    led = smooth + jumping
    led[::finer] = whole
    return PrescribedMotion(led, spline(spline.x, 1) + speed, straight, at_once, lead, finer)


def _on_finer_grid(held: np.ndarray, mean: np.ndarray, finer: int) -> tuple[np.ndarray, np.ndarray]:
    """Both (N, joints) at `finer` points per sample: what is held stays, a mean runs straight."""
    at = np.arange(finer * (len(held) - 1) + 1) / finer
    straight = [np.interp(at, np.arange(len(mean)), column) for column in mean.T]
    return held[at.astype(int)], np.column_stack(straight)


def _fine_spline(
    x: np.ndarray, finer: int, dt: float, flat: tuple[np.ndarray, np.ndarray] | None
) -> np.ndarray:
    """Smooth x (N, k) at `finer` points per sample, dt s apart; `flat`: it begins without a speed,
    with this second and third derivative."""
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
    """(L + N, joints): what the drive's torque does to the joints at once."""
    joints, n = place.shape[1], model.arm.coordinates
    torque = model.servo.jumps(numbers.law, task.references)
    if n == joints or not np.any(np.diff(torque, axis=0)) or not np.isfinite(torque).all():
        return np.zeros_like(place)
    q = np.zeros((len(torque), n))
    q[:, :joints] = place[lead:]
    key = Structure.of(model.arm), _digest(weighing(numbers.p, joints), torque, place[lead:])
    found = _ACCELERATIONS.get(
        key,
        lambda: _instant_acceleration(
            model.compiled.dynamics, q, numbers.p, np.ascontiguousarray(torque)
        ),
    )
    if not np.isfinite(found).all():  # sizes so far off that no mass matrix is left
        return np.zeros_like(place)
    if not lead:
        return found
    # From rest: the first step says how much of the first torque made the joint move.
    first = 2.0 * (place[lead + 1] - place[lead]) / task.sample_time**2
    moves = np.clip(first, np.minimum(found[0], 0.0), np.maximum(found[0], 0.0))
    return np.vstack([np.repeat((found[0] - moves)[None], lead, axis=0), found])


_ACCELERATIONS = BoundedCache[np.ndarray](CAPACITY, lambda found: found.nbytes)
"""Stiffnesses, friction and sensors leave it as it is."""


def _integrated(held: np.ndarray, mean: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Places and speeds (N, joints) of accelerations `held` (N, joints) minus `mean` (N, joints),
    which runs straight between samples."""
    a, b = held[:-1] - mean[:-1], held[:-1] - mean[1:]
    nothing = np.zeros((1, held.shape[1]))
    speed = np.vstack([nothing, np.cumsum(0.5 * (a + b) * dt, axis=0)])
    steps = speed[:-1] * dt + (2.0 * a + b) * dt**2 / 6.0
    return np.vstack([nothing, np.cumsum(steps, axis=0)]), speed


@kernel(matrix(DYNAMICS, matrix, vector, matrix))
def _instant_acceleration(dynamics, q, p, torque):  # type: ignore[no-untyped-def]
    """(N, nj) accelerations that torques (N, nj) cause at once at places q (N, n)."""
    N, n = q.shape
    nj = torque.shape[1]
    M, f, still = np.empty(n * n), np.empty(n), np.zeros(n)
    found = np.empty((N, nj))
    for t in range(N):
        dynamics(q[t], still, p, M, f)
        for i in range(n):
            f[i] = torque[t, i] if i < nj else 0.0
        factor_positive(M, n)
        substitute_positive(M, n, f)
        for i in range(nj):
            found[t, i] = f[i]
    return found
