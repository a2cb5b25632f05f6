"""The compiled non-linear simulator: a linearly implicit two-stage Rosenbrock-W method.

ROS2 of Verwer et al. (SIAM J. Sci. Comput. 20, 1999): second order for any approximate
Jacobian W, L-stable for gamma = 1 - 1/sqrt(2). W holds what is stiff, the bending stiffness and
damping and the drive's feedback, so steps need not resolve poles of 10^5 rad/s.

    (I - gamma h W) k1 = f(y)
    (I - gamma h W) k2 = f(y + h k1) - 2 k1
    y+ = y + 3/2 h k1 + 1/2 h k2

It is written once and compiled twice, for one arm and for LANES side by side (core.lanes.wide). The
lanes have one structure (coordinates, states of the drive, force laws, steps per sample) and differ
in everything else: parameters, references, starts, sample times.
"""

from __future__ import annotations

import numpy as np
from numba import int64, njit, types

from ..arm.signatures import DYNAMICS, TIP, Kernel, filling, matrix, vector
from ..lanes.algebra import (
    add_product,
    advance,
    combine,
    copy,
    factor_square,
    multiply,
    multiply_square,
    read,
    solve_positive,
    substitute_square,
    subtract_square,
    write,
    zeros,
)
from ..lanes.functions import INLINE
from ..lanes.wide import any_lane, get, put, select
from ..simulate.bristles import bound, friction_rates
from ..simulate.elements import (
    ELEMENTS,
    OUT_PER_PORT,
    OUT_PER_STATE,
    WIDE_ELEMENTS,
    add_known,
    load,
    push,
    push_implicitly,
    see,
    state_stage,
)

GAMMA = 1.0 - 1.0 / np.sqrt(2.0)


def implicit_parts(
    K: np.ndarray, D: np.ndarray, law: tuple[np.ndarray, ...], h: float
) -> tuple[np.ndarray, ...]:
    """Constant matrices (A, B, T, T2, inverse, A0, B0) of a step of length h, with g = gamma h.

    K and D (n, n) are the arm's; the drive's feedback is added here. The stage equations are
    (M + A) kv = M b - B a - T c - T2 a, kq = a + g kv, ks = inverse (c + g (Fq kq + Fv kv)).
    A0 and B0 are those of the arm alone: the rows of a joint whose drive is at its limit.
    """
    _, P, V, S, Fs, Fq, Fv = law[:7]
    joints = P.shape[0]
    g = GAMMA * h
    inverse = np.linalg.inv(np.eye(len(Fs)) - g * Fs)
    A0, B0 = g * D + g * g * K, g * K
    K, D, T = K.copy(), D.copy(), np.zeros((len(K), len(Fs)))
    K[:joints] += P
    D[:joints] += V
    T[:joints] = g * S @ inverse
    A = g * D + g * g * K + g * T @ (Fv + g * Fq)
    parts = (A, g * K, T, g * T @ Fq, inverse, A0, B0)
    return tuple(np.ascontiguousarray(part) for part in parts)


@njit(**{**INLINE, "_nrt": True})
def parts_of(y, n, ns):  # type: ignore[no-untyped-def]
    """[q, q', s, w] of a state or of its rates."""
    return y[:n], y[n : 2 * n], y[2 * n : 2 * n + ns], y[2 * n + ns :]


@njit(**INLINE)
def drive_torque(law, r, now, u):  # type: ignore[no-untyped-def]
    """u (nj,) of core.drives.law.DriveLaw."""
    q, v, s, _ = now
    multiply(u, law[0], r)
    add_product(u, -1.0, law[1], q)
    add_product(u, -1.0, law[2], v)
    add_product(u, -1.0, law[3], s)
    for i in range(u.shape[0]):
        most, torque = get(law[8], i), get(u, i)
        put(u, i, select(torque > most, most, select(torque < -most, -most, torque)))


@njit(**INLINE)
def see_rates(dynamics, law, p, r, now, u, M, d):  # type: ignore[no-untyped-def]
    """M (n, n) and the right sides d = [q', f + G u, s'] without elements; the joints are the first
    coordinates."""
    q, v, s, _ = now
    a, f, c, _ = d
    copy(a, v)
    dynamics(q, v, p, M, f)
    for i in range(u.shape[0]):
        put(f, i, get(f, i) + get(u, i))
    multiply(c, law[4], s)
    add_product(c, 1.0, law[5], q)
    add_product(c, 1.0, law[6], v)
    add_product(c, 1.0, law[7], r)


@njit(**INLINE)
def without_feedback(cuts, M, parts, W, both, T):  # type: ignore[no-untyped-def]
    """A drive at its limit does not react: its rows of the step's matrices are the arm's own."""
    _, B, whole_T, T2, inverse, A0, B0 = parts
    joints, n, ns = cuts.shape[0], rows_of(M), rows_of(inverse)
    for i in range(joints):
        sign = get(cuts, i)
        free = (sign < 0.5) & (sign > -0.5)
        for at in range(i * n, (i + 1) * n):
            put(W, at, select(free, get(W, at), get(M, at) + get(A0, at)))
            put(both, at, select(free, get(B, at) + get(T2, at), get(B0, at)))
        for at in range(i * ns, (i + 1) * ns):
            put(T, at, select(free, get(whole_T, at), 0.0))


@njit(**INLINE)
def rows_of(A):  # type: ignore[no-untyped-def]
    """n of a square matrix A (n n,)."""
    return int(np.sqrt(A.shape[0]) + 0.5)


@njit(**INLINE)
def cut_drives(cuts, u, limit):  # type: ignore[no-untyped-def]
    """cuts (nj,): 1 or -1 where a drive gives its largest torque, else 0."""
    for i in range(cuts.shape[0]):
        most, torque = get(limit, i), get(u, i)
        put(cuts, i, select(torque >= most, 1.0, select(torque <= -most, -1.0, 0.0)))


@njit(**INLINE)
def release_drives(cuts, u, limit):  # type: ignore[no-untyped-def]
    """Frees the drives that would give less than their limit; whether there are any."""
    released = False
    for i in range(cuts.shape[0]):
        sign = get(cuts, i)
        limited = (sign > 0.5) | (sign < -0.5)
        free = limited & (sign * get(u, i) < get(limit, i))
        put(cuts, i, select(free, 0.0, sign))
        released = released or any_lane(free)
    return released


@njit(**INLINE)
def solve_stage(solvers, law, inverse, step, elements, ports, g, b, d, w, back, kw1, late, k):  # type: ignore[no-untyped-def]
    """k of (I - g W) k = d, with b the mass matrix times the part of d that is q''; M + A stands
    already factored in W. Of bristles see core.simulate.bristles.solve_friction."""
    W, note, both, T, M, M2 = step
    x, xd, out, slopes, work = ports
    a, _, c, cw = d
    kq, kv, ks, kw = k
    copy(kv, b)
    subtract_square(solvers, kv, both, a)
    add_known(elements, a, cw, slopes, kv)
    add_product(kv, -1.0, T, c)
    substitute_square(solvers, W, note, kv)
    if elements[7].size > 0:
        friction_rates(
            solvers, elements, W, note, M, M2, late, x, xd, out, g, w, back, kw1, work, kv, kw
        )
    combine(kq, a, g, kv)
    add_product(c, g, law[5], kq)
    add_product(c, g, law[6], kv)
    multiply(ks, inverse, c)
    state_stage(elements, cw, kv, slopes, kw)


def _integrate(  # type: ignore[no-untyped-def]  # noqa: PLR0913
    dynamics, tip, solvers, p, law, parts, packed, r, straight, y0, dt, samples, substeps, limited
):
    """States (N (2 n + ns + nw),) and drive torques (N nj,) at the N samples, and the `note` of
    core.lanes.algebra.factor_square.

    Matrices lie row by row; of LANES arms each number stands for all of them. `solvers` begins with
    the number of coordinates, see core.lanes.algebra; p (np,); `law` and
    `parts` as core.drives.law.DriveLaw and `implicit_parts` have them; r (N nr,), of each row the
    first `straight` run straight between samples, the others are held; y0 (2 n + ns + nw,); dt (1,)
    in s; `limited` says whether any drive has a limit.
    """
    addresses, firsts, states_of, values_of, _, _, tips, bristles, loads = packed
    # The tip's directions and loads are written here, and other threads may run the same model.
    directions, values = packed[4].copy(), packed[5].copy()
    elements = (
        addresses, firsts, states_of, values_of, directions, values, tips, bristles, loads
    )  # fmt: skip
    n, joints, nw = solvers[0], law[8].shape[0], states_of[-1]
    K, Q = firsts[-1], bristles.size
    nr, length = r.shape[0] // samples, y0.shape[0]
    ns = length - 2 * n - nw
    x, xd, z, J = zeros(y0, K), zeros(y0, K), zeros(y0, 2), zeros(y0, 2 * n)
    out = zeros(y0, OUT_PER_PORT * K + OUT_PER_STATE * nw)
    slopes = (zeros(y0, K), zeros(y0, nw), zeros(y0, nw), zeros(y0, nw))
    work = (
        zeros(y0, Q * n), zeros(y0, Q * Q), zeros(y0, Q), zeros(y0, Q), zeros(y0, Q), zeros(y0, Q),
        zeros(y0, n), zeros(y0, n),
    )  # fmt: skip
    ports = (x, xd, out, slopes, work)
    M, M2, W, note = zeros(y0, n * n), zeros(y0, n * n), zeros(y0, n * n), zeros(y0, n)
    both, T = zeros(y0, n * n), parts[2].copy()
    combine(both, parts[1], 1.0, parts[3])
    step = (W, note, both, T, M, M2)
    y, y2, d, d0 = y0.copy(), zeros(y0, length), zeros(y0, length), zeros(y0, length)
    k1, k2, b = zeros(y0, length), zeros(y0, length), zeros(y0, n)
    now, then = parts_of(y, n, ns), parts_of(y2, n, ns)
    right, first_stage = parts_of(d, n, ns), parts_of(d0, n, ns)
    first, second = parts_of(k1, n, ns), parts_of(k2, n, ns)
    f, cw = right[1], right[3]
    u, cuts = zeros(y0, joints), zeros(y0, joints)
    r1, r2, slope = zeros(y0, nr), zeros(y0, nr), zeros(y0, nr)
    states, torques = zeros(y0, samples * length), zeros(y0, samples * joints)
    h = get(dt, 0) / substeps
    g = GAMMA * h
    for k in range(samples):
        write(states, k * length, y)
        read(r2, r, k * nr)
        drive_torque(law, r2, now, u)
        write(torques, k * joints, u)
        if k == samples - 1:
            break
        for i in range(straight):
            put(slope, i, (get(r, (k + 1) * nr + i) - get(r, k * nr + i)) / substeps)
        for _ in range(substeps):
            copy(r1, r2)
            combine(r2, r1, 1.0, slope)
            drive_torque(law, r1, now, u)
            see_rates(dynamics, law, p, r1, now, u, M, first_stage)
            if limited:
                cut_drives(cuts, u, law[8])
            if K > 0:
                see(tip, elements, now[0], now[1], p, x, xd, z, J)
                load(elements, u)
            again = True
            while again:
                copy(d, d0)
                combine(W, M, 1.0, parts[0])
                if limited:
                    without_feedback(cuts, M, parts, W, both, T)
                if K > 0:
                    push_implicitly(elements, x, xd, now[3], out, f, cw, g, W, slopes)
                factor_square(solvers, W, note)
                solve_stage(
                    solvers, law, parts[4], step, elements, ports, g, f, right, now[3], 0.0 * g,
                    first[3], False, first,
                )  # fmt: skip
                combine(y2, y, h, k1)
                drive_torque(law, r2, then, u)
                again = limited and release_drives(cuts, u, law[8])
            see_rates(dynamics, law, p, r2, then, u, M2, right)
            if K > 0:
                see(tip, elements, then[0], then[1], p, x, xd, z, J)
                load(elements, u)
                push(elements, x, xd, then[3], out, f, cw)
            solve_positive(solvers, M2, f)
            combine(d, d, -2.0, k1)
            multiply_square(solvers, b, M, f)
            solve_stage(
                solvers, law, parts[4], step, elements, ports, g, b, right, then[3], 2.0 * g,
                first[3], True, second,
            )  # fmt: skip
            advance(y, 1.5 * h, k1, 0.5 * h, k2)
            if Q > 0:
                bound(bristles, states_of, now[3])
    return states, torques, note


def _compiled(numbers, dynamics, tip, solvers, elements) -> Kernel:  # type: ignore[no-untyped-def]
    """`_integrate` for arrays of numbers of one type."""
    law, parts = types.UniTuple(numbers, 9), types.UniTuple(numbers, 7)
    return Kernel(
        _integrate,
        types.UniTuple(numbers, 3)(
            dynamics, tip, solvers, numbers, law, parts, elements, numbers, int64, numbers,
            numbers, int64, int64, types.boolean,
        ),
    )  # fmt: skip


_SOLVERS = types.Tuple((int64, *[filling(matrix, count) for count in (2, 2, 2, 3, 3)]))
integrate = _compiled(vector, DYNAMICS, TIP, types.Tuple((int64,)), ELEMENTS)
integrate_lanes = _compiled(matrix, filling(matrix, 5), filling(matrix, 4), _SOLVERS, WIDE_ELEMENTS)
