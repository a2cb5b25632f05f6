"""An arm whose joints are led along a recorded motion: the joints are given, the rest is simulated.

A virtual servo takes the joints along the encoders' signals, whatever the arm is. So the joints
need no simulation: they move as the encoders say, and only what bends or twists beyond them is
integrated. The servo's stiffness, which grows as a joint's inertia shrinks, does not enter, and the
steps need only resolve what the arm does by itself. Its response is a filter of the missing torque
(core.identify.prepared).

Between the samples the joints move as the drive makes them: it holds a torque u from one sample to
the next, so their acceleration jumps at the samples by S^-1 times the jump of u, where
S = M_jj - M_je M_ee^-1 M_ej is what a joint weighs at once. That part is integrated twice, and what
the encoders say beyond it is smooth: a spline. Without the jumps, a spline through a motion that
switches in every third period of a vibration drives that vibration by some per cent. Where few
samples fall on a vibration, straight accelerations between them miss it (1 % at 1.5 rad a sample),
so the motion is led on a finer grid (`finer_by`), along a spline of higher degree.

The torque follows from M q'' - f = u, averaged over the two samples around each with the weight of
a triangle: a second difference is that average of an acceleration, and the mean of two neighbours
that of a torque that is held between samples. Both are exact, also where a torque jumps. With j
the joints, e the other coordinates and f averaged over the finer grid by its own curvature,

    M_ee a_e = f_e - M_ej a_j,    u = M_jj a_j + M_je a_e - f_j.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numba import njit, types
from scipy.interpolate import CubicSpline, make_interp_spline
from scipy.ndimage import convolve1d, uniform_filter1d

from core.arm.signatures import DYNAMICS, OPTIONS, TIP, matrix, vector
from core.arm.slots import HUB_INERTIA, slot, weighing
from core.arm.symbols import Structure
from core.drives.law import static_law
from core.drives.servo import FollowingServo, acceleration, bend
from core.identify.led_points import finer_by
from core.model import Model, Numbers
from core.recent import Recent
from core.simulate.elements import ELEMENTS, push, see
from core.simulate.many import Job
from core.simulate.motion import Task
from core.simulate.small import factor_positive, substitute_positive
from core.trajectory import Trajectory

HEAVY = 1e6
"""Times the arm's inertia at a joint: what the joints are given while the rest is simulated, so
that the arm moves them by a millionth of what it would."""

DRIFT_HZ = 0.1
"""Takes back what the integrated acceleration drifts from the prescribed motion; slow, since there
is next to nothing to take back, and between samples straight lines lie beside the curved speed: at
5 Hz that alone made an acceleration of a hundredth."""


def is_prescribed(model: Model, numbers: Numbers) -> bool:
    """Whether the joints' motion is known before anything is simulated.

    A drive that has a limit or states of its own answers the servo, and a force with a state, or
    one that depends on the drive's torque, is known only while it is simulated.
    """
    if not isinstance(model.steering, FollowingServo) or model.level != "nonlinear":
        return False
    law = numbers.law
    known = not any(e.law.states or e.law.loaded for e in numbers.elements)
    return known and not law.states and not np.any(np.isfinite(law.limit))


def is_given(model: Model, numbers: Numbers) -> bool:
    """Whether nothing is left to simulate: an arm that has no coordinate but its joints."""
    return is_prescribed(model, numbers) and model.arm.coordinates == model.arm.joints


AVERAGE = 32
"""Samples over which a mean is taken off the held acceleration, so that its integral stays small
beside the places; the mean runs straight between samples and makes no jump."""


DEGREE = 7
"""Of the spline from which a finer grid is read; at 1.5 rad per sample it misses less of an
acceleration than the jumps that no spline follows."""


class Led(NamedTuple):
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


def joint_motion(model: Model, numbers: Numbers, task: Task) -> Led:
    """Through what the encoders say; with the time before the recording where it begins at rest and
    nothing is known of what the arm does at the first sample."""
    joints, n = model.arm.joints, model.arm.coordinates
    place, finer = task.references[:, -2 * joints : -joints], finer_by(model, task.sample_time)
    known = np.any(task.start[joints:n]) or np.any(task.start[n + joints : 2 * n])
    lead = 0 if task.before is None or known else len(task.before)
    whole = np.vstack([task.before, place]) if lead and task.before is not None else place
    if not np.isfinite(whole).all():  # a simulation that goes astray is told as such
        nothing = np.full((finer * (len(whole) - 1) + 1, joints), np.nan)
        return Led(nothing, nothing, nothing, nothing, lead, finer)
    at_once = _held_acceleration(model, numbers, task, whole, lead)
    dt = task.sample_time
    key = _digest(whole, at_once), lead, finer, dt
    return _LED.get(key, lambda: _led(whole, at_once, lead, finer, dt))


def _digest(*arrays: np.ndarray) -> bytes:
    found = hashlib.blake2b(digest_size=16)
    for array in arrays:
        found.update(np.ascontiguousarray(array).tobytes())
    return found.digest()


CAPACITY = 64 * 2**20
"""Bytes: some dozen recordings of ten thousand samples, each at a few values of a parameter. A
number of motions would be too few for many short recordings, which then push each other out, and
too many for long ones."""

_LED = Recent[Led](CAPACITY, lambda led: sum(part.nbytes for part in led[:4]))
"""Most parameters of a fit leave a motion as it is, and splines cost more than simulating an arm of
few coordinates along them."""


def _led(whole: np.ndarray, at_once: np.ndarray, lead: int, finer: int, sample_time: float) -> Led:
    """The motion through places (L + N, joints); `at_once` (L + N, joints) is the part of its
    acceleration that is held between samples."""
    mean = uniform_filter1d(at_once, AVERAGE, axis=0, mode="nearest")
    at_once, mean = _between(at_once, mean, finer)
    dt = sample_time / finer
    jumping, speed = _integrated(at_once, mean, dt)
    # At rest there is neither speed nor acceleration; what they are at other ends nobody knows.
    flat = (mean[0] - at_once[0], (mean[1] - mean[0]) / dt) if lead else None
    smooth = _finely(whole - jumping[::finer], finer, dt, flat)
    # A speed at the start, read out of the first samples' noise, would shake the arm to the end.
    begin = "not-a-knot" if flat is None else (1, np.zeros_like(flat[0]))
    spline = CubicSpline(np.arange(len(smooth)) * dt, smooth, bc_type=(begin, "not-a-knot"))
    straight = spline(spline.x, 2) - mean
    led = smooth + jumping
    led[::finer] = whole
    return Led(led, spline(spline.x, 1) + speed, straight, at_once, lead, finer)


def _between(held: np.ndarray, mean: np.ndarray, finer: int) -> tuple[np.ndarray, np.ndarray]:
    """Both (N, joints) at `finer` points per sample: what is held stays, a mean runs straight."""
    at = np.arange(finer * (len(held) - 1) + 1) / finer
    straight = [np.interp(at, np.arange(len(mean)), column) for column in mean.T]
    return held[at.astype(int)], np.column_stack(straight)


def _finely(
    x: np.ndarray, finer: int, dt: float, flat: tuple[np.ndarray, np.ndarray] | None
) -> np.ndarray:
    """Smooth x (N, k) at `finer` points per sample, dt s apart; `flat`: it begins without a speed,
    with this second and third derivative."""
    if finer == 1:
        return x.copy()
    t, half = np.arange(len(x)) * (finer * dt), (DEGREE - 1) // 2
    at = np.arange(finer * (len(x) - 1) + 1) * dt
    if len(x) <= 2 * DEGREE:
        return np.asarray(CubicSpline(t, x)(at))
    begin = None if flat is None else [(1, np.zeros_like(flat[0])), (2, flat[0]), (3, flat[1])]
    inner = t[1 + (half if begin is None else 0) : -1 - half]
    knots = np.concatenate([np.repeat(t[0], DEGREE + 1), inner, np.repeat(t[-1], DEGREE + 1)])
    return np.asarray(make_interp_spline(t, x, DEGREE, knots, (begin, None))(at))


def _held_acceleration(
    model: Model, numbers: Numbers, task: Task, place: np.ndarray, lead: int
) -> np.ndarray:
    """(L + N, joints): what the drive's torque does to the joints at once."""
    joints, n = place.shape[1], model.arm.coordinates
    torque = joint_servo(model).jumps(numbers.law, task.references)
    if n == joints or not np.any(np.diff(torque, axis=0)) or not np.isfinite(torque).all():
        return np.zeros_like(place)
    q = np.zeros((len(torque), n))
    q[:, :joints] = place[lead:]
    key = Structure.of(model.arm), _digest(weighing(numbers.p, joints), torque, place[lead:])
    found = _WEIGHED.get(
        key, lambda: _at_once(model.compiled.dynamics, q, numbers.p, np.ascontiguousarray(torque))
    )
    if not np.isfinite(found).all():  # sizes so far off that no mass matrix is left
        return np.zeros_like(place)
    if not lead:
        return found
    # From rest: the first step says how much of the first torque made the joint move.
    first = 2.0 * (place[lead + 1] - place[lead]) / task.sample_time**2
    moves = np.clip(first, np.minimum(found[0], 0.0), np.maximum(found[0], 0.0))
    return np.vstack([np.repeat((found[0] - moves)[None], lead, axis=0), found])


_WEIGHED = Recent[np.ndarray](CAPACITY, lambda found: found.nbytes)
"""Stiffnesses, friction and sensors leave it as it is."""


def _integrated(held: np.ndarray, mean: np.ndarray, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Places and speeds (N, joints) of accelerations `held` (N, joints) minus `mean` (N, joints),
    which runs straight between samples."""
    a, b = held[:-1] - mean[:-1], held[:-1] - mean[1:]
    nothing = np.zeros((1, held.shape[1]))
    speed = np.vstack([nothing, np.cumsum(0.5 * (a + b) * dt, axis=0)])
    steps = speed[:-1] * dt + (2.0 * a + b) * dt**2 / 6.0
    return np.vstack([nothing, np.cumsum(steps, axis=0)]), speed


def given_motion(model: Model, numbers: Numbers, task: Task) -> Trajectory:
    """The motion and torque of an arm that has no coordinate but its joints."""
    motion = joint_motion(model, numbers, task)
    return _with_torque(model, numbers, task, motion, motion.place, motion.speed)


def prescribed_job(model: Model, numbers: Numbers, task: Task) -> Job:
    """The simulation of what the joints take along; its result has the joints' torque."""
    joints, n = model.arm.joints, model.arm.coordinates
    motion = joint_motion(model, numbers, task)
    inertia = HEAVY * np.diag(joint_servo(model).inertia)
    w = 2.0 * np.pi * DRIFT_HZ
    P, V = np.zeros((joints, n)), np.zeros((joints, n))
    P[:, :joints], V[:, :joints] = w * w * inertia, 2.0 * w * inertia
    R = np.hstack([P[:, :joints], V[:, :joints], inertia, inertia])
    p = numbers.p.copy()
    p[[slot(k, HUB_INERTIA) for k in range(joints)]] += np.diag(inertia)
    start = task.start.copy()
    start[:joints], start[n : n + joints] = motion.place[0], motion.speed[0]
    led = replace(
        task, time=np.arange(len(motion.place)) * (task.sample_time / motion.finer), start=start,
        references=np.hstack(motion[:4]), before=None,
    )  # fmt: skip
    law = static_law(R, P, V, interpolate=True, held=joints)
    finish = _finished(model, numbers, task, motion)
    return Job(model, numbers._replace(p=p, law=law), led, finish)


def _finished(
    model: Model, numbers: Numbers, task: Task, motion: Led
) -> Callable[[Trajectory], Trajectory]:
    """Puts the joints' own motion and torque into what was simulated."""

    def finish(simulated: Trajectory) -> Trajectory:
        joints = motion.place.shape[1]
        q, v = simulated.q.copy(), simulated.v.copy()
        q[:, :joints], v[:, :joints] = motion.place, motion.speed
        return _with_torque(model, numbers, task, motion, q, v)

    return finish


def _with_torque(
    model: Model, numbers: Numbers, task: Task, motion: Led, q: np.ndarray, v: np.ndarray
) -> Trajectory:
    """Of q, v (finer (L + N - 1) + 1, n), the recorded samples with the joints' torque."""
    joints, compiled, finer = model.arm.joints, model.compiled, motion.finer
    q, v = np.ascontiguousarray(q), np.ascontiguousarray(v)
    a = np.ascontiguousarray(acceleration(q[::finer, :joints], task.sample_time))
    packed = numbers.packed(model.arm.coordinates).packed()
    M, f = _equations(compiled.dynamics, compiled.tip, q, v, numbers.p, packed)
    # A triangle over two samples is made of the same over two points of the finer grid.
    weights = (finer - np.abs(np.arange(1 - finer, finer))) / finer**2
    averaged = convolve1d(f + bend(f), weights, axis=0, mode="nearest")[::finer]
    torque = _joint_torque(np.ascontiguousarray(M[::finer]), np.ascontiguousarray(averaged), a)
    q, v, torque = (
        np.ascontiguousarray(x[motion.lead :]) for x in (q[::finer], v[::finer], torque)
    )
    return Trajectory(model.arm, compiled, numbers.p, task.time, q, v, torque)


def joint_servo(model: Model) -> FollowingServo:
    """What leads the joints."""
    assert isinstance(model.steering, FollowingServo)
    return model.steering


cube = types.float64[:, :, ::1]


@njit(types.Tuple((cube, matrix))(DYNAMICS, TIP, matrix, matrix, vector, ELEMENTS), **OPTIONS)
def _equations(dynamics, tip, q, v, p, given):  # type: ignore[no-untyped-def]
    """M (N, n, n) and f (N, n) with the elements' forces, along q, v (N, n)."""
    N, n = q.shape
    elements = (
        given[0], given[1], given[2], given[3], given[4].copy(), given[5].copy(), given[6],
        given[7], given[8],
    )  # fmt: skip
    K = given[4].shape[0]
    x, xd, z, J, out = np.empty(K), np.empty(K), np.empty(2), np.empty((2, n)), np.empty(3 * K)
    w, dw = np.zeros(0), np.zeros(0)
    M, f = np.empty((N, n, n)), np.empty((N, n))
    for t in range(N):
        dynamics(q[t], v[t], p, M[t], f[t])
        if K > 0:
            see(tip, elements, q[t], v[t], p, x, xd, z, J)
            push(elements, x, xd, w, out, f[t], dw)
    return M, f


@njit(matrix(DYNAMICS, matrix, vector, matrix), **OPTIONS)
def _at_once(dynamics, q, p, torque):  # type: ignore[no-untyped-def]
    """(N, nj) accelerations that torques (N, nj) cause at once at places q (N, n)."""
    N, n = q.shape
    nj = torque.shape[1]
    M, f, still = np.empty((n, n)), np.empty(n), np.zeros(n)
    found = np.empty((N, nj))
    for t in range(N):
        dynamics(q[t], still, p, M, f)
        for i in range(n):
            f[i] = torque[t, i] if i < nj else 0.0
        factor_positive(M)
        substitute_positive(M, f)
        for i in range(nj):
            found[t, i] = f[i]
    return found


@njit(matrix(cube, matrix, matrix), **OPTIONS)
def _joint_torque(M, f, a):  # type: ignore[no-untyped-def]
    """u (N, nj) from M (N, n, n), averaged f (N, n) and the joints' accelerations a (N, nj)."""
    N, n = f.shape
    nj = a.shape[1]
    ne = n - nj
    Me, ae = np.empty((ne, ne)), np.empty(ne)
    torque = np.empty((N, nj))
    for t in range(N):
        for i in range(ne):
            ae[i] = f[t, nj + i]
            for j in range(nj):
                ae[i] -= M[t, nj + i, j] * a[t, j]
            for j in range(ne):
                Me[i, j] = M[t, nj + i, nj + j]
        if ne > 0:
            factor_positive(Me)
            substitute_positive(Me, ae)
        for i in range(nj):
            total = -f[t, i]
            for j in range(nj):
                total += M[t, i, j] * a[t, j]
            for j in range(ne):
                total += M[t, i, nj + j] * ae[j]
            torque[t, i] = total
    return torque
