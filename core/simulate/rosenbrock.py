"""The compiled non-linear simulator: a linearly implicit two-stage Rosenbrock-W method.

ROS2 of Verwer et al. (SIAM J. Sci. Comput. 20, 1999): second order for any approximate
Jacobian W, L-stable for gamma = 1 - 1/sqrt(2). W holds what is stiff, the bending stiffness and
damping and the drive's feedback, so steps need not resolve poles of 10^5 rad/s.

    (I - gamma h W) k1 = f(y)
    (I - gamma h W) k2 = f(y + h k1) - 2 k1
    y+ = y + 3/2 h k1 + 1/2 h k2
"""

from __future__ import annotations

import numpy as np
from numba import int64, njit, types

from core.arm.signatures import DYNAMICS, TIP, kernel, matrix, vector
from core.simulate.bristles import answer, apply_forces, bound, free_speeds, solve_friction
from core.simulate.elements import (
    ELEMENTS,
    OUT_PER_PORT,
    OUT_PER_STATE,
    add_known,
    load,
    push,
    push_implicitly,
    see,
    state_stage,
)
from core.simulate.small import (
    INLINE,
    add_matrices,
    add_product,
    advance,
    combine,
    factor,
    factor_positive,
    multiply,
    read_row,
    substitute,
    substitute_positive,
    write_row,
)

GAMMA = 1.0 - 1.0 / np.sqrt(2.0)

LAW = types.Tuple((matrix, matrix, matrix, matrix, matrix, matrix, matrix, matrix, vector))
"""The arrays of core.drives.law.DriveLaw, in its order."""
IMPLICIT = types.UniTuple(matrix, 7)
"""What `implicit_parts` returns."""


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
    for i in range(u.size):
        if u[i] > limit[i]:
            u[i] = limit[i]
        elif u[i] < -limit[i]:
            u[i] = -limit[i]


@njit(**INLINE)
def add_torque(f, u):  # type: ignore[no-untyped-def]
    """f += G u: the joints are the first coordinates."""
    for i in range(u.size):
        f[i] += u[i]


@njit(**INLINE)
def without_feedback(cuts, M, A0, B0, B, T2, whole_T, W, both, T):  # type: ignore[no-untyped-def]
    """A drive at its limit does not react: its rows of the step's matrices are the arm's own."""
    for i in range(cuts.size):
        cut = cuts[i] != 0.0
        for j in range(M.shape[0]):
            if cut:
                W[i, j] = M[i, j] + A0[i, j]
            both[i, j] = B0[i, j] if cut else B[i, j] + T2[i, j]
        for j in range(T.shape[1]):
            T[i, j] = 0.0 if cut else whole_T[i, j]


@njit(**INLINE)
def drive_rate(Fs, Fq, Fv, Fr, r, q, v, s, ds):  # type: ignore[no-untyped-def]
    """ds (ns,), the rates of the drive's own states."""
    multiply(ds, Fs, s)
    add_product(ds, 1.0, Fq, q)
    add_product(ds, 1.0, Fv, v)
    add_product(ds, 1.0, Fr, r)


@njit(**INLINE)
def solve_rates(W, pivots, B, T, elements, slopes, a, b, c, cw, kv):  # type: ignore[no-untyped-def]
    """kv of (I - g W) k = (a, M^-1 b, c, cw), with M + A already factored in W."""
    Fx, Fw, _, rw = slopes
    combine(kv, b, 0.0, b)
    add_product(kv, -1.0, B, a)
    add_known(elements, a, cw, Fx, Fw, rw, kv)
    add_product(kv, -1.0, T, c)
    substitute(W, pivots, kv)


@njit(**INLINE)
def solve_rest(inverse, Fq, Fv, g, elements, slopes, a, c, cw, kq, kv, ks, kw):  # type: ignore[no-untyped-def]
    """The rest of k from its kv."""
    _, _, rv, rw = slopes
    combine(kq, a, g, kv)
    add_product(c, g, Fq, kq)
    add_product(c, g, Fv, kv)
    multiply(ks, inverse, c)
    state_stage(elements, cw, kv, rv, rw, kw)


@kernel(
    types.Tuple((matrix, matrix))(
        DYNAMICS, TIP, vector, LAW, IMPLICIT, ELEMENTS, matrix, int64, vector,
        types.float64, int64,
    ),
)  # fmt: skip
def integrate(dynamics, tip, p, law, parts, given, r, straight, y0, dt, substeps):  # type: ignore[no-untyped-def]
    """States (N, 2 n + ns + nw) and drive torques (N, nj) at the N samples of references r (N, nr).

    The first `straight` references run straight between samples, the others are held.
    """
    addresses, ports, states_of, values_of, _, _, tips, bristles, loads = given
    # The tip's directions and loads are written here, and other threads may run the same model.
    directions, values = given[4].copy(), given[5].copy()
    elements = (
        addresses, ports, states_of, values_of, directions, values, tips, bristles, loads
    )  # fmt: skip
    joints, ns, nw = law[0].shape[0], law[4].shape[0], states_of[-1]
    K = directions.shape[0]
    n = (y0.size - ns - nw) // 2
    x, xd, z, J = np.empty(K), np.empty(K), np.empty(2), np.empty((2, n))
    out = np.empty(OUT_PER_PORT * K + OUT_PER_STATE * nw)
    slopes = (np.zeros(K), np.zeros(nw), np.zeros(nw), np.zeros(nw))
    w, w2, cw = y0[2 * n + ns :].copy(), y0[2 * n + ns :].copy(), np.zeros(nw)
    kw1, kw2 = np.zeros(nw), np.zeros(nw)
    Q = bristles.size
    columns, D, col, row = np.empty((Q, n)), np.empty((Q, Q)), np.empty(n), np.empty(n)
    free, speed, force, share = np.zeros(Q), np.zeros(Q), np.zeros(Q), np.zeros(Q)
    N = r.shape[0]
    h = dt / substeps
    g = GAMMA * h
    states, torques = np.empty((N, y0.size)), np.empty((N, joints))
    q, v, s = y0[:n].copy(), y0[n : 2 * n].copy(), y0[2 * n : 2 * n + ns].copy()
    q2, v2, s2 = q.copy(), v.copy(), s.copy()
    R, P, V, S, Fs, Fq, Fv, Fr, limit = law
    A, B, whole_T, T2, inverse, A0, B0 = parts
    both, T = np.empty((n, n)), whole_T.copy()
    add_matrices(both, B, T2)
    limited = False
    for i in range(joints):
        limited = limited or np.isfinite(limit[i])
    M, M2, W = np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    f, a, b, c, u = np.empty(n), np.empty(n), np.empty(n), np.empty(ns), np.empty(joints)
    kq1, kv1, ks1 = np.empty(n), np.empty(n), np.empty(ns)
    kq2, kv2, ks2 = np.empty(n), np.empty(n), np.empty(ns)
    pivots = np.empty(n, dtype=np.int64)
    cuts, f0, c0 = np.zeros(joints), np.empty(n), np.empty(ns)
    r1, r2, slope = np.empty(r.shape[1]), np.empty(r.shape[1]), np.zeros(r.shape[1])
    for k in range(N):
        write_row(states, k, 0, q)
        write_row(states, k, n, v)
        write_row(states, k, 2 * n, s)
        write_row(states, k, 2 * n + ns, w)
        read_row(r2, r, k)
        drive_torque(R, P, V, S, limit, r2, q, v, s, u)
        write_row(torques, k, 0, u)
        if k == N - 1:
            break
        for i in range(straight):
            slope[i] = (r[k + 1, i] - r[k, i]) / substeps
        for _ in range(substeps):
            combine(r1, r2, 0.0, slope)
            combine(r2, r1, 1.0, slope)
            dynamics(q, v, p, M, f)
            drive_torque(R, P, V, S, limit, r1, q, v, s, u)
            drive_rate(Fs, Fq, Fv, Fr, r1, q, v, s, c)
            add_torque(f, u)
            for i in range(joints):
                cuts[i] = 0.0
                if u[i] >= limit[i]:
                    cuts[i] = 1.0
                elif u[i] <= -limit[i]:
                    cuts[i] = -1.0
            if K > 0:
                see(tip, elements, q, v, p, x, xd, z, J)
                load(elements, u)
            combine(f0, f, 0.0, f)
            combine(c0, c, 0.0, c)
            again = True
            while again:
                again = False
                combine(f, f0, 0.0, f0)
                combine(c, c0, 0.0, c0)
                add_matrices(W, M, A)
                if limited:
                    without_feedback(cuts, M, A0, B0, B, T2, whole_T, W, both, T)
                if K > 0:
                    push_implicitly(
                        elements, x, xd, w, out, f, cw, g, W, slopes[0], slopes[1], slopes[2],
                        slopes[3],
                    )  # fmt: skip
                factor(W, pivots)
                solve_rates(W, pivots, both, T, elements, slopes, v, f, c, cw, kv1)
                if Q > 0:
                    answer(
                        bristles, ports, directions, W, pivots, M, M2, False, col, row, columns, D
                    )
                    free_speeds(bristles, ports, directions, xd, g, kv1, free)
                    solve_friction(
                        bristles, addresses, ports, states_of, values_of, values, D, g, x, w, 0.0,
                        kw1, free, speed, force, share, out,
                    )  # fmt: skip
                    apply_forces(bristles, states_of, columns, force, share, w, g, kv1, kw1)
                solve_rest(inverse, Fq, Fv, g, elements, slopes, v, c, cw, kq1, kv1, ks1, kw1)
                combine(q2, q, h, kq1)
                combine(v2, v, h, kv1)
                combine(s2, s, h, ks1)
                combine(w2, w, h, kw1)
                drive_torque(R, P, V, S, limit, r2, q2, v2, s2, u)
                for i in range(joints):
                    if cuts[i] * u[i] < limit[i] and cuts[i] != 0.0:
                        cuts[i] = 0.0
                        again = True
            dynamics(q2, v2, p, M2, f)
            drive_rate(Fs, Fq, Fv, Fr, r2, q2, v2, s2, c)
            add_torque(f, u)
            if K > 0:
                see(tip, elements, q2, v2, p, x, xd, z, J)
                load(elements, u)
                push(elements, x, xd, w2, out, f, cw)
            factor_positive(M2)
            substitute_positive(M2, f)
            combine(f, f, -2.0, kv1)
            multiply(b, M, f)
            combine(a, v2, -2.0, kq1)
            combine(c, c, -2.0, ks1)
            combine(cw, cw, -2.0, kw1)
            solve_rates(W, pivots, both, T, elements, slopes, a, b, c, cw, kv2)
            if Q > 0:
                answer(bristles, ports, directions, W, pivots, M, M2, True, col, row, columns, D)
                free_speeds(bristles, ports, directions, xd, g, kv2, free)
                solve_friction(
                    bristles, addresses, ports, states_of, values_of, values, D, g, x, w2, 2.0 * g,
                    kw1, free, speed, force, share, out,
                )  # fmt: skip
                apply_forces(bristles, states_of, columns, force, share, w2, g, kv2, kw2)
            solve_rest(inverse, Fq, Fv, g, elements, slopes, a, c, cw, kq2, kv2, ks2, kw2)
            advance(q, 1.5 * h, kq1, 0.5 * h, kq2)
            advance(v, 1.5 * h, kv1, 0.5 * h, kv2)
            advance(s, 1.5 * h, ks1, 0.5 * h, ks2)
            advance(w, 1.5 * h, kw1, 0.5 * h, kw2)
            if Q > 0:
                bound(bristles, states_of, w)
    return states, torques
