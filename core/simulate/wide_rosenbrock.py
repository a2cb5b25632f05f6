"""The compiled simulator for LANES arms side by side: core.simulate.rosenbrock with wide numbers.

The lanes have one structure (coordinates, states of the drive, force laws, steps per sample) and
differ in everything else: parameters, references, starts, sample times.
"""

from __future__ import annotations

import numpy as np
from numba import int64, njit, types

from core.arm.signatures import kernel, matrix
from core.lanes.algebra import (
    add,
    add_product,
    advance,
    combine,
    copy,
    multiply,
    read,
    write,
)
from core.lanes.functions import INLINE
from core.lanes.wide import (
    LANES,
    any_lane,
    get,
    maximum,
    minimum,
    put,
    select,
    spread,
)
from core.simulate.elements import OUT_PER_PORT, OUT_PER_STATE
from core.simulate.rosenbrock import GAMMA
from core.simulate.wide_bristles import answer, apply_forces, bound, free_speeds, solve_friction
from core.simulate.wide_elements import (
    WIDE_ELEMENTS,
    add_known,
    load,
    push,
    push_implicitly,
    see,
    state_stage,
)

WIDE_DYNAMICS = types.FunctionType(types.void(matrix, matrix, matrix, matrix, matrix))
WIDE_TIP = types.FunctionType(types.void(matrix, matrix, matrix, matrix))
_TWO = types.FunctionType(types.void(matrix, matrix))
_THREE = types.FunctionType(types.void(matrix, matrix, matrix))
WIDE_LAW = types.UniTuple(matrix, 9)
"""The arrays of core.drives.law.DriveLaw, in its order, each (entries, LANES)."""
WIDE_PARTS = types.UniTuple(matrix, 7)
"""What core.simulate.rosenbrock.implicit_parts returns, each (entries, LANES)."""


@njit(**INLINE)
def drive_torque(R, P, V, S, limit, r, q, v, s, u):  # type: ignore[no-untyped-def]
    """u (nj,) of core.drives.law.DriveLaw."""
    joints = u.shape[0]
    multiply(u, R, r, joints, r.shape[0])
    add_product(u, -1.0, P, q, joints, q.shape[0])
    add_product(u, -1.0, V, v, joints, v.shape[0])
    add_product(u, -1.0, S, s, joints, s.shape[0])
    for i in range(joints):
        most = get(limit, i)
        put(u, i, maximum(minimum(get(u, i), most), -most))


@njit(**INLINE)
def add_torque(f, u):  # type: ignore[no-untyped-def]
    """f += G u: the joints are the first coordinates."""
    for i in range(u.shape[0]):
        put(f, i, get(f, i) + get(u, i))


@njit(**INLINE)
def drive_rate(Fs, Fq, Fv, Fr, r, q, v, s, ds):  # type: ignore[no-untyped-def]
    """ds (ns,), the rates of the drive's own states."""
    ns, n = ds.shape[0], q.shape[0]
    multiply(ds, Fs, s, ns, ns)
    add_product(ds, 1.0, Fq, q, ns, n)
    add_product(ds, 1.0, Fv, v, ns, n)
    add_product(ds, 1.0, Fr, r, ns, r.shape[0])


@njit(**INLINE)
def without_feedback(cuts, n, M, A0, B0, B, T2, whole_T, W, both, T):  # type: ignore[no-untyped-def]
    """A drive at its limit does not react: its rows of the step's matrices are the arm's own."""
    joints = cuts.shape[0]
    ns = T.shape[0] // n
    for i in range(joints):
        cut = get(cuts, i)
        free = (cut < 0.5) & (cut > -0.5)
        for j in range(n):
            at = i * n + j
            put(W, at, select(free, get(W, at), get(M, at) + get(A0, at)))
            put(both, at, select(free, get(B, at) + get(T2, at), get(B0, at)))
        for j in range(ns):
            put(T, i * ns + j, select(free, get(whole_T, i * ns + j), 0.0))


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
def solve_rates(substitute, subtract, W, B, T, elements, slopes, a, b, c, cw, kv):  # type: ignore[no-untyped-def]
    """kv of (I - g W) k = (a, M^-1 b, c, cw), with M + A already factored in W."""
    Fx, Fw, _, rw = slopes
    copy(kv, b)
    subtract(B, a, kv)
    add_known(elements, a, cw, Fx, Fw, rw, kv)
    add_product(kv, -1.0, T, c, kv.shape[0], c.shape[0])
    substitute(W, kv)


@njit(**INLINE)
def solve_rest(inverse, Fq, Fv, g, elements, slopes, a, c, cw, kq, kv, ks, kw):  # type: ignore[no-untyped-def]
    """The rest of k from its kv."""
    _, _, rv, rw = slopes
    n, ns = kv.shape[0], c.shape[0]
    combine(kq, a, g, kv)
    add_product(c, g, Fq, kq, ns, n)
    add_product(c, g, Fv, kv, ns, n)
    multiply(ks, inverse, c, ns, ns)
    state_stage(elements, cw, kv, rv, rw, kw)


@kernel(
    types.Tuple((matrix, matrix, matrix))(
        WIDE_DYNAMICS, WIDE_TIP, _TWO, _TWO, _TWO, _THREE, _THREE,
        matrix, WIDE_LAW, WIDE_PARTS, WIDE_ELEMENTS, matrix,
        int64, matrix, matrix, int64, int64, types.boolean,
    ),
)  # fmt: skip
def integrate(  # type: ignore[no-untyped-def]  # noqa: PLR0913
    dynamics, tip, factor, substitute, solve_positive, multiply_square, subtract_square,
    p, law, parts, given, r, straight, y0, dt, samples, substeps, limited,
):  # fmt: skip
    """States (N (2 n + ns + nw), LANES), drive torques (N nj, LANES), and the largest growth of a
    pivot (1, LANES), see core.lanes.algebra.factor.

    p (np, LANES); r (N nr, LANES), the first `straight` of a row
    run straight between samples; y0 (2 n + ns + nw, LANES); dt (1, LANES); `limited` says
    whether any drive has a limit.
    """
    addresses, ports, states_of, values_of, _, _, tips, bristles, loads = given
    # The tip's directions and loads are written here, and other threads may run the same model.
    directions, values = given[4].copy(), given[5].copy()
    elements = (
        addresses, ports, states_of, values_of, directions, values, tips, bristles, loads
    )  # fmt: skip
    R, P, V, S, Fs, Fq, Fv, Fr, limit = law
    A, B, whole_T, T2, inverse, A0, B0 = parts
    joints, nw, K = limit.shape[0], states_of[-1], ports[-1]
    N, nr, length = samples, r.shape[0] // samples, y0.shape[0]
    n = B.shape[0]
    n = int(round(np.sqrt(n)))
    ns = length - 2 * n - nw
    x, xd = np.empty((K, LANES)), np.empty((K, LANES))
    z, J = np.empty((2, LANES)), np.empty((2 * n, LANES))
    out = np.empty((OUT_PER_PORT * K + OUT_PER_STATE * nw, LANES))
    slopes = (
        np.zeros((K, LANES)), np.zeros((nw, LANES)), np.zeros((nw, LANES)), np.zeros((nw, LANES))
    )  # fmt: skip
    q, v, s, w = (
        np.empty((n, LANES)), np.empty((n, LANES)), np.empty((ns, LANES)), np.empty((nw, LANES))
    )  # fmt: skip
    read(q, y0, 0)
    read(v, y0, n)
    read(s, y0, 2 * n)
    read(w, y0, 2 * n + ns)
    q2, v2, s2, w2 = q.copy(), v.copy(), s.copy(), w.copy()
    cw, kw1, kw2 = np.zeros((nw, LANES)), np.zeros((nw, LANES)), np.zeros((nw, LANES))
    Q = bristles.size
    columns, D = np.empty((Q * n, LANES)), np.empty((Q * Q, LANES))
    col, row = np.empty((n, LANES)), np.empty((n, LANES))
    free, speed = np.zeros((Q, LANES)), np.zeros((Q, LANES))
    force, share = np.zeros((Q, LANES)), np.zeros((Q, LANES))
    states, torques = np.empty((N * length, LANES)), np.empty((N * joints, LANES))
    both, T = np.empty((n * n, LANES)), whole_T.copy()
    add(both, B, T2)
    M, M2, W = np.empty((n * n, LANES)), np.empty((n * n, LANES)), np.empty((n * n, LANES))
    f, a, b, c = (
        np.empty((n, LANES)), np.empty((n, LANES)), np.empty((n, LANES)), np.empty((ns, LANES))
    )  # fmt: skip
    u, cuts = np.empty((joints, LANES)), np.zeros((joints, LANES))
    kq1, kv1, ks1 = np.empty((n, LANES)), np.empty((n, LANES)), np.empty((ns, LANES))
    kq2, kv2, ks2 = np.empty((n, LANES)), np.empty((n, LANES)), np.empty((ns, LANES))
    f0, c0 = np.empty((n, LANES)), np.empty((ns, LANES))
    r1, r2, slope = np.empty((nr, LANES)), np.empty((nr, LANES)), np.zeros((nr, LANES))
    h = get(dt, 0) / substeps
    g = GAMMA * h
    growth = np.ones((1, LANES))
    for k in range(N):
        write(states, k * length, q)
        write(states, k * length + n, v)
        write(states, k * length + 2 * n, s)
        write(states, k * length + 2 * n + ns, w)
        read(r2, r, k * nr)
        drive_torque(R, P, V, S, limit, r2, q, v, s, u)
        write(torques, k * joints, u)
        if k == N - 1:
            break
        for i in range(straight):
            put(slope, i, (get(r, (k + 1) * nr + i) - get(r, k * nr + i)) / substeps)
        for _ in range(substeps):
            copy(r1, r2)
            add(r2, r1, slope)
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
                add(W, M, A)
                if limited:
                    without_feedback(cuts, n, M, A0, B0, B, T2, whole_T, W, both, T)
                if K > 0:
                    push_implicitly(
                        elements, x, xd, w, out, f, cw, g, W, slopes[0], slopes[1], slopes[2],
                        slopes[3],
                    )  # fmt: skip
                factor(W, growth)
                solve_rates(
                    substitute, subtract_square, W, both, T, elements, slopes, v, f, c, cw, kv1
                )
                if Q > 0:
                    answer(
                        bristles,
                        ports,
                        directions,
                        W,
                        M,
                        M2,
                        False,
                        substitute,
                        multiply_square,
                        col,
                        row,
                        columns,
                        D,
                    )
                    free_speeds(bristles, ports, directions, xd, g, kv1, free)
                    solve_friction(
                        bristles, addresses, ports, states_of, values_of, values, D, g, x, w,
                        spread(0.0), kw1, free, speed, force, share, out,
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
            solve_positive(M2, f)
            combine(f, f, -2.0, kv1)
            multiply_square(M, f, b)
            combine(a, v2, -2.0, kq1)
            combine(c, c, -2.0, ks1)
            combine(cw, cw, -2.0, kw1)
            solve_rates(substitute, subtract_square, W, both, T, elements, slopes, a, b, c, cw, kv2)
            if Q > 0:
                answer(
                    bristles,
                    ports,
                    directions,
                    W,
                    M,
                    M2,
                    True,
                    substitute,
                    multiply_square,
                    col,
                    row,
                    columns,
                    D,
                )
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
    return states, torques, growth
