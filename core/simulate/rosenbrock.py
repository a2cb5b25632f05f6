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

from core.arm.signatures import DYNAMICS, TIP, Kernel, filling, matrix, vector
from core.lanes.algebra import (
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
from core.lanes.functions import INLINE
from core.lanes.wide import any_lane, get, put, select
from core.simulate.bristles import answer, apply_forces, bound, free_speeds, solve_friction
from core.simulate.elements import (
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


@njit(**INLINE)
def drive_torque(R, P, V, S, limit, r, q, v, s, u):  # type: ignore[no-untyped-def]
    """u (nj,) of core.drives.law.DriveLaw."""
    multiply(u, R, r)
    add_product(u, -1.0, P, q)
    add_product(u, -1.0, V, v)
    add_product(u, -1.0, S, s)
    for i in range(u.shape[0]):
        most, torque = get(limit, i), get(u, i)
        put(u, i, select(torque > most, most, select(torque < -most, -most, torque)))


@njit(**INLINE)
def drive_rate(Fs, Fq, Fv, Fr, r, q, v, s, ds):  # type: ignore[no-untyped-def]
    """ds (ns,), the rates of the drive's own states."""
    multiply(ds, Fs, s)
    add_product(ds, 1.0, Fq, q)
    add_product(ds, 1.0, Fv, v)
    add_product(ds, 1.0, Fr, r)


@njit(**INLINE)
def add_torque(f, u):  # type: ignore[no-untyped-def]
    """f += G u: the joints are the first coordinates."""
    for i in range(u.shape[0]):
        put(f, i, get(f, i) + get(u, i))


@njit(**INLINE)
def without_feedback(cuts, n, M, A0, B0, B, T2, whole_T, W, both, T):  # type: ignore[no-untyped-def]
    """A drive at its limit does not react: its rows of the step's matrices are the arm's own."""
    ns = T.shape[0] // n
    for i in range(cuts.shape[0]):
        cut = get(cuts, i)
        free = (cut < 0.5) & (cut > -0.5)
        for at in range(i * n, (i + 1) * n):
            put(W, at, select(free, get(W, at), get(M, at) + get(A0, at)))
            put(both, at, select(free, get(B, at) + get(T2, at), get(B0, at)))
        for at in range(i * ns, (i + 1) * ns):
            put(T, at, select(free, get(whole_T, at), 0.0))


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
        cut = get(cuts, i)
        held = (cut > 0.5) | (cut < -0.5)
        free = held & (cut * get(u, i) < get(limit, i))
        put(cuts, i, select(free, 0.0, cut))
        released = released or any_lane(free)
    return released


@njit(**INLINE)
def solve_rates(solvers, W, note, B, T, elements, slopes, a, b, c, cw, kv):  # type: ignore[no-untyped-def]
    """kv of (I - g W) k = (a, M^-1 b, c, cw), with M + A already factored in W."""
    copy(kv, b)
    subtract_square(solvers, kv, B, a)
    add_known(elements, a, cw, slopes, kv)
    add_product(kv, -1.0, T, c)
    substitute_square(solvers, W, note, kv)


@njit(**INLINE)
def solve_rest(inverse, Fq, Fv, g, elements, slopes, a, c, cw, kq, kv, ks, kw):  # type: ignore[no-untyped-def]
    """The rest of k from its kv."""
    combine(kq, a, g, kv)
    add_product(c, g, Fq, kq)
    add_product(c, g, Fv, kv)
    multiply(ks, inverse, c)
    state_stage(elements, cw, kv, slopes, kw)


def _integrate(  # type: ignore[no-untyped-def]  # noqa: PLR0913
    dynamics, tip, solvers, p, law, parts, given, r, straight, y0, dt, samples, substeps, limited
):
    """States (N (2 n + ns + nw),) and drive torques (N nj,) at the N samples, and the `note` of
    core.lanes.algebra.factor_square.

    Matrices lie row by row; of LANES arms each number stands for all of them. `solvers` begins with
    the number of coordinates, see core.lanes.algebra; p (np,); `law` and
    `parts` as core.drives.law.DriveLaw and `implicit_parts` have them; r (N nr,), of each row the
    first `straight` run straight between samples, the others are held; y0 (2 n + ns + nw,); dt (1,)
    in s; `limited` says whether any drive has a limit.
    """
    addresses, ports, states_of, values_of, _, _, tips, bristles, loads = given
    # The tip's directions and loads are written here, and other threads may run the same model.
    directions, values = given[4].copy(), given[5].copy()
    elements = (
        addresses, ports, states_of, values_of, directions, values, tips, bristles, loads
    )  # fmt: skip
    R, P, V, S, Fs, Fq, Fv, Fr, limit = law
    A, B, whole_T, T2, inverse, A0, B0 = parts
    n = solvers[0]
    joints, nw, K, Q = limit.shape[0], states_of[-1], ports[-1], bristles.size
    nr, length = r.shape[0] // samples, y0.shape[0]
    ns = length - 2 * n - nw
    x, xd, z, J = zeros(y0, K), zeros(y0, K), zeros(y0, 2), zeros(y0, 2 * n)
    out = zeros(y0, OUT_PER_PORT * K + OUT_PER_STATE * nw)
    slopes = (zeros(y0, K), zeros(y0, nw), zeros(y0, nw), zeros(y0, nw))
    q, v, s, w = zeros(y0, n), zeros(y0, n), zeros(y0, ns), zeros(y0, nw)
    read(q, y0, 0)
    read(v, y0, n)
    read(s, y0, 2 * n)
    read(w, y0, 2 * n + ns)
    q2, v2, s2, w2 = zeros(y0, n), zeros(y0, n), zeros(y0, ns), zeros(y0, nw)
    cw, kw1, kw2 = zeros(y0, nw), zeros(y0, nw), zeros(y0, nw)
    columns, D, col, row = zeros(y0, Q * n), zeros(y0, Q * Q), zeros(y0, n), zeros(y0, n)
    free, speed, force, share = zeros(y0, Q), zeros(y0, Q), zeros(y0, Q), zeros(y0, Q)
    states, torques = zeros(y0, samples * length), zeros(y0, samples * joints)
    both, T = zeros(y0, n * n), whole_T.copy()
    combine(both, B, 1.0, T2)
    M, M2, W, note = zeros(y0, n * n), zeros(y0, n * n), zeros(y0, n * n), zeros(y0, n)
    f, a, b, c = zeros(y0, n), zeros(y0, n), zeros(y0, n), zeros(y0, ns)
    u, cuts, f0, c0 = zeros(y0, joints), zeros(y0, joints), zeros(y0, n), zeros(y0, ns)
    kq1, kv1, ks1 = zeros(y0, n), zeros(y0, n), zeros(y0, ns)
    kq2, kv2, ks2 = zeros(y0, n), zeros(y0, n), zeros(y0, ns)
    r1, r2, slope = zeros(y0, nr), zeros(y0, nr), zeros(y0, nr)
    h = get(dt, 0) / substeps
    g = GAMMA * h
    for k in range(samples):
        write(states, k * length, q)
        write(states, k * length + n, v)
        write(states, k * length + 2 * n, s)
        write(states, k * length + 2 * n + ns, w)
        read(r2, r, k * nr)
        drive_torque(R, P, V, S, limit, r2, q, v, s, u)
        write(torques, k * joints, u)
        if k == samples - 1:
            break
        for i in range(straight):
            put(slope, i, (get(r, (k + 1) * nr + i) - get(r, k * nr + i)) / substeps)
        for _ in range(substeps):
            copy(r1, r2)
            combine(r2, r1, 1.0, slope)
            dynamics(q, v, p, M, f)
            drive_torque(R, P, V, S, limit, r1, q, v, s, u)
            drive_rate(Fs, Fq, Fv, Fr, r1, q, v, s, c)
            add_torque(f, u)
            if limited:
                cut_drives(cuts, u, limit)
            if K > 0:
                see(tip, elements, q, v, p, x, xd, z, J)
                load(elements, u)
            copy(f0, f)
            copy(c0, c)
            again = True
            while again:
                copy(f, f0)
                copy(c, c0)
                combine(W, M, 1.0, A)
                if limited:
                    without_feedback(cuts, n, M, A0, B0, B, T2, whole_T, W, both, T)
                if K > 0:
                    push_implicitly(elements, x, xd, w, out, f, cw, g, W, slopes)
                factor_square(solvers, W, note)
                solve_rates(solvers, W, note, both, T, elements, slopes, v, f, c, cw, kv1)
                if Q > 0:
                    answer(
                        solvers, bristles, ports, directions, W, note, M, M2, False, col, row,
                        columns, D,
                    )  # fmt: skip
                    free_speeds(bristles, ports, directions, xd, g, kv1, free)
                    solve_friction(
                        bristles, addresses, ports, states_of, values_of, values, D, g, x, w,
                        0.0 * g, kw1, free, speed, force, share, out,
                    )  # fmt: skip
                    apply_forces(bristles, states_of, columns, force, share, w, g, kv1, kw1)
                solve_rest(inverse, Fq, Fv, g, elements, slopes, v, c, cw, kq1, kv1, ks1, kw1)
                combine(q2, q, h, kq1)
                combine(v2, v, h, kv1)
                combine(s2, s, h, ks1)
                combine(w2, w, h, kw1)
                drive_torque(R, P, V, S, limit, r2, q2, v2, s2, u)
                again = limited and release_drives(cuts, u, limit)
            dynamics(q2, v2, p, M2, f)
            drive_rate(Fs, Fq, Fv, Fr, r2, q2, v2, s2, c)
            add_torque(f, u)
            if K > 0:
                see(tip, elements, q2, v2, p, x, xd, z, J)
                load(elements, u)
                push(elements, x, xd, w2, out, f, cw)
            solve_positive(solvers, M2, f)
            combine(f, f, -2.0, kv1)
            multiply_square(solvers, b, M, f)
            combine(a, v2, -2.0, kq1)
            combine(c, c, -2.0, ks1)
            combine(cw, cw, -2.0, kw1)
            solve_rates(solvers, W, note, both, T, elements, slopes, a, b, c, cw, kv2)
            if Q > 0:
                answer(
                    solvers, bristles, ports, directions, W, note, M, M2, True, col, row,
                    columns, D,
                )  # fmt: skip
                free_speeds(bristles, ports, directions, xd, g, kv2, free)
                solve_friction(
                    bristles, addresses, ports, states_of, values_of, values, D, g, x, w2,
                    2.0 * g, kw1, free, speed, force, share, out,
                )  # fmt: skip
                apply_forces(bristles, states_of, columns, force, share, w2, g, kv2, kw2)
            solve_rest(inverse, Fq, Fv, g, elements, slopes, a, c, cw, kq2, kv2, ks2, kw2)
            advance(q, 1.5 * h, kq1, 0.5 * h, kq2)
            advance(v, 1.5 * h, kv1, 0.5 * h, kv2)
            advance(s, 1.5 * h, ks1, 0.5 * h, ks2)
            advance(w, 1.5 * h, kw1, 0.5 * h, kw2)
            if Q > 0:
                bound(bristles, states_of, w)
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
