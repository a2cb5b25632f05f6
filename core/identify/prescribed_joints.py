"""An arm whose joints are led along a recorded motion: the joints are given, the rest is simulated.

A virtual servo takes the joints along the encoders' signals, whatever the arm is. So the joints
need no simulation: they move as the encoders say, and only what bends or twists beyond them is
integrated. The servo's stiffness, which grows as a joint's inertia shrinks, does not enter, and the
steps need only resolve what the arm does by itself. Its response is a filter of the missing torque
(core.identify.prepared_recording).

Where the joints are between the samples is found in core.identify.prescribed_joint_motion.

The torque follows from M q'' - f = u, averaged over the two samples around each with the weight of
a triangle: a second difference is that average of an acceleration, and the mean of two neighbours
that of a torque that is held between samples. Both are exact, also where a torque jumps. With j
the joints, e the other coordinates and f averaged over the finer grid by its own curvature,

    M_ee a_e = f_e - M_ej a_j,    u = M_jj a_j + M_je a_e - f_j.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy
from numba import types

from ..arm.signatures import DYNAMICS, TIP, kernel, matrix, vector
from ..arm.slots import HUB_INERTIA, slot
from ..drives.law import static_law
from ..drives.servo import acceleration, chord_error
from ..identify.prescribed_joint_motion import PrescribedMotion, prescribed_motion
from ..lanes.algebra import factor_positive, substitute_positive
from ..model import Model, Numbers
from ..simulate.batch import Job
from ..simulate.elements import ELEMENTS, push, see
from ..simulate.motion import Task
from ..trajectory import Trajectory

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
    if model.steering is None or model.level != "nonlinear":
        return False
    law = numbers.law
    known = not any(e.law.states or e.law.loaded for e in numbers.elements)
    return known and not law.states and not np.any(np.isfinite(law.limit))


def is_fully_prescribed(model: Model, numbers: Numbers) -> bool:
    """Whether nothing is left to simulate: an arm that has no coordinate but its joints."""
    return is_prescribed(model, numbers) and model.arm.coordinates == model.arm.joints


def fully_prescribed_motion(model: Model, numbers: Numbers, task: Task) -> Trajectory:
    """The motion and torque of an arm that has no coordinate but its joints."""
    motion = prescribed_motion(model, numbers, task)
    return _with_torque(model, numbers, task, motion, motion.place, motion.speed)


def prescribed_job(model: Model, numbers: Numbers, task: Task) -> Job:
    """The simulation of what the joints take along; its result has the joints' torque."""
    joints, n = model.arm.joints, model.arm.coordinates
    motion = prescribed_motion(model, numbers, task)
    inertia = HEAVY * np.diag(model.servo.inertia)
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
    finish = _result_maker(model, numbers, task, motion)
    return Job(model, numbers._replace(p=p, law=law), led, finish)


def _result_maker(
    model: Model, numbers: Numbers, task: Task, motion: PrescribedMotion
) -> Callable[[Trajectory], Trajectory]:
    """Puts the joints' own motion and torque into what was simulated."""

    def finish(simulated: Trajectory) -> Trajectory:
        joints = motion.place.shape[1]
        q, v = simulated.q.copy(), simulated.v.copy()
        q[:, :joints], v[:, :joints] = motion.place, motion.speed
        return _with_torque(model, numbers, task, motion, q, v)

    return finish


def _with_torque(
    model: Model,
    numbers: Numbers,
    task: Task,
    motion: PrescribedMotion,
    q: np.ndarray,
    v: np.ndarray,
) -> Trajectory:
    """Of q, v (finer (L + N - 1) + 1, n), the recorded samples with the joints' torque."""
    joints, compiled, finer = model.arm.joints, model.compiled, motion.finer
    q, v = np.ascontiguousarray(q), np.ascontiguousarray(v)
    a = np.ascontiguousarray(acceleration(q[::finer, :joints], task.sample_time))
    packed = numbers.packed(model.arm.coordinates).packed()
    M, f = _equations(compiled.dynamics, compiled.tip, q, v, numbers.p, packed)
    # A triangle over two samples is made of the same over two points of the finer grid.
    weights = (finer - np.abs(np.arange(1 - finer, finer))) / finer**2
    averaged = scipy.ndimage.convolve1d(f + chord_error(f), weights, axis=0, mode="nearest")[
        ::finer
    ]
    torque = _joint_torque(np.ascontiguousarray(M[::finer]), np.ascontiguousarray(averaged), a)
    q, v, torque = (
        np.ascontiguousarray(x[motion.lead :]) for x in (q[::finer], v[::finer], torque)
    )
    return Trajectory(model.arm, compiled, numbers.p, task.time, q, v, torque)


@kernel(types.Tuple((matrix, matrix))(DYNAMICS, TIP, matrix, matrix, vector, ELEMENTS))
def _equations(dynamics, tip, q, v, p, given):  # type: ignore[no-untyped-def]
    """M (N, n n) and f (N, n) with the elements' forces, along q, v (N, n)."""
    N, n = q.shape
    elements = (
        given[0], given[1], given[2], given[3], given[4].copy(), given[5].copy(), given[6],
        given[7], given[8],
    )  # fmt: skip
    K = given[1][-1]
    x, xd, z, J, out = np.empty(K), np.empty(K), np.empty(2), np.empty(2 * n), np.empty(3 * K)
    w, dw = np.zeros(0), np.zeros(0)
    M, f = np.empty((N, n * n)), np.empty((N, n))
    for t in range(N):
        dynamics(q[t], v[t], p, M[t], f[t])
        if K > 0:
            see(tip, elements, q[t], v[t], p, x, xd, z, J)
            push(elements, x, xd, w, out, f[t], dw)
    return M, f


@kernel(matrix(matrix, matrix, matrix))
def _joint_torque(M, f, a):  # type: ignore[no-untyped-def]
    """u (N, nj) from M (N, n n), averaged f (N, n) and the joints' accelerations a (N, nj)."""
    N, n = f.shape
    nj = a.shape[1]
    ne = n - nj
    Me, ae = np.empty(ne * ne), np.empty(ne)
    torque = np.empty((N, nj))
    for t in range(N):
        for i in range(ne):
            ae[i] = f[t, nj + i]
            for j in range(nj):
                ae[i] -= M[t, (nj + i) * n + j] * a[t, j]
            for j in range(ne):
                Me[i * ne + j] = M[t, (nj + i) * n + nj + j]
        if ne > 0:
            factor_positive(Me, ne)
            substitute_positive(Me, ne, ae)
        for i in range(nj):
            total = -f[t, i]
            for j in range(nj):
                total += M[t, i * n + j] * a[t, j]
            for j in range(ne):
                total += M[t, i * n + nj + j] * ae[j]
            torque[t, i] = total
    return torque
