"""Simulation of an arm with prescribed joint motion: only bending and twist are integrated.

A virtual servo moves the joints as the encoders measured, whatever the arm is, so the joints need
no simulation. The servo's stiffness, which grows as a joint's inertia shrinks, does not enter, and
the steps only resolve the arm's own motion. Its response is a filter of the missing torque
(core.identify.prepared_recording). The motion between samples is that of
core.identify.prescribed_joint_motion.

The torque follows from M q'' - f = u, averaged over the two samples around each with triangular
weights: a second difference is that average of an acceleration, and the mean of two neighbours that
of a held torque. Both are exact, also where a torque jumps. With j the joints, e the other
coordinates and f averaged over the finer grid,

M_ee a_e = f_e - M_ej a_j,    u = M_jj a_j + M_je a_e - f_j.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy

from ..arm.signatures import addresses, dynamics_of, kernel, matrix, tip_of, vector
from ..arm.slots import HUB_INERTIA, slot
from ..compiler import types
from ..drives.law import static_law
from ..drives.servo import acceleration, chord_error
from ..identify.prescribed_joint_motion import PrescribedMotion, prescribed_motion
from ..lanes.algebra import factor_positive, substitute_positive
from ..model import Model, Numbers
from ..progress import count_simulations
from ..simulate.batch import Job
from ..simulate.elements import ELEMENTS, push, see, write_inputs
from ..simulate.motion import Task
from ..trajectory import Trajectory

HEAVY = 1e6
"""Factor on the arm's inertia at a joint during the simulation, so that the arm moves the joints by
a millionth."""

DRIFT_HZ = 0.1
"""Corrects the drift of the integrated acceleration; slow, since there is little to correct, and
linear interpolation at 5 Hz alone made an acceleration error of a hundredth."""


def is_prescribed(model: Model, numbers: Numbers) -> bool:
    """Whether the joints' motion is known before the simulation. A drive with a limit or states
    responds to the servo, and a force with a state or one that depends on the drive's torque must
    be simulated."""
    if model.steering is None or model.level != "nonlinear":
        return False
    law = numbers.law
    motion_only = not any(e.law.states or e.written for e in numbers.elements)
    return motion_only and not law.states and not np.any(np.isfinite(law.limit))


def is_fully_prescribed(model: Model, numbers: Numbers) -> bool:
    """Whether nothing is left to simulate: the arm has only joint coordinates."""
    return is_prescribed(model, numbers) and model.arm.coordinates == model.arm.joints


def fully_prescribed_motion(model: Model, numbers: Numbers, task: Task) -> Trajectory:
    """Motion and torque of an arm with only joint coordinates."""
    motion = prescribed_motion(model, numbers, task)
    count_simulations(1)
    return _with_torque(model, numbers, task, motion, motion.place, motion.speed)


def prescribed_job(model: Model, numbers: Numbers, task: Task) -> Job:
    """The simulation of the other coordinates; its result has the joints' torque."""
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
    prescribed_task = replace(
        task, time=np.arange(len(motion.place)) * (task.sample_time / motion.finer), start=start,
        references=np.hstack(motion[:4]), before=None, inputs=_finer_inputs(task, motion),
    )  # fmt: skip
    law = static_law(R, P, V, interpolate=True, held=joints)
    finish = _result_maker(model, numbers, task, motion)
    return Job(model, numbers._replace(p=p, law=law), prescribed_task, finish)


def _finer_inputs(task: Task, motion: PrescribedMotion) -> np.ndarray | None:
    """(finer (L + N - 1) + 1, inputs) at the points of the motion: straight between samples, and
    before the recording as at its first one."""
    if task.inputs is None:
        return None
    at = np.arange(len(motion.place)) / motion.finer - motion.lead
    samples = np.arange(len(task.inputs))
    return np.column_stack([np.interp(at, samples, column) for column in task.inputs.T])


def _result_maker(
    model: Model, numbers: Numbers, task: Task, motion: PrescribedMotion
) -> Callable[[Trajectory], Trajectory]:
    """Makes a function that puts the prescribed motion and torque into a simulated motion."""

    def finish(simulated: Trajectory) -> Trajectory:
        joints = motion.place.shape[1]
        q, v = simulated.q.copy(), simulated.v.copy()
        q[:, :joints], v[:, :joints] = motion.place, motion.speed
        return _with_torque(model, numbers, task, motion, q, v)

    return finish


def _with_torque(
    model: Model, numbers: Numbers, task: Task, motion: PrescribedMotion, q: np.ndarray,
    v: np.ndarray,
) -> Trajectory:  # fmt: skip
    """The recorded samples of q, v (finer (L + N - 1) + 1, n), with the joints' torque."""
    joints, compiled, finer = model.arm.joints, model.compiled, motion.finer
    q, v = np.ascontiguousarray(q), np.ascontiguousarray(v)
    a = np.ascontiguousarray(acceleration(q[::finer, :joints], task.sample_time))
    packed = numbers.packed(model.arm.coordinates).packed()
    inputs = _finer_inputs(task, motion)
    signals = np.zeros((len(q), 0)) if inputs is None else np.ascontiguousarray(inputs)
    M, f = _equations(compiled.addresses, q, v, numbers.p, packed, signals, joints)
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


@kernel(
    types.Tuple((matrix, matrix))(addresses, matrix, matrix, vector, ELEMENTS, matrix, types.int64)
)
def _equations(arm, q, v, p, packed, inputs, joints):  # type: ignore[no-untyped-def]
    """M (N, n n) and f (N, n) with the elements' forces, along q, v (N, n) and inputs (N, k)."""
    (N, n), dynamics, tip = q.shape, dynamics_of(arm), tip_of(arm)
    elements = (
        packed[0], packed[1], packed[2], packed[3], packed[4].copy(), packed[5].copy(), packed[6],
        packed[7], packed[8],
    )  # fmt: skip
    K = packed[1][-1]
    x, xd, z, J, out = np.empty(K), np.empty(K), np.empty(2), np.empty(2 * n), np.empty(3 * K)
    w, dw, torques = np.zeros(0), np.zeros(0), np.zeros(joints)
    M, f = np.empty((N, n * n)), np.empty((N, n))
    for t in range(N):
        dynamics(q[t], v[t], p, M[t], f[t])
        if K > 0:
            write_inputs(elements, torques, inputs[t])
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
