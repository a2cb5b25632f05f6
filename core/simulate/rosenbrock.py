"""The compiled non-linear simulator: a linearly implicit two-stage Rosenbrock-W method.

ROS2 of Verwer et al. (SIAM J. Sci. Comput. 20, 1999): second order for any approximate
Jacobian W, L-stable for gamma = 1 - 1/sqrt(2). W holds what is stiff, the bending stiffness and
damping and the drive's feedback, so steps need not resolve poles of 10^5 rad/s.

    (I - gamma h W) k1 = f(y)
    (I - gamma h W) k2 = f(y + h k1) - 2 k1
    y+ = y + 3/2 h k1 + 1/2 h k2

It simulates LANES arms side by side (core.lanes.wide). The lanes have one structure (coordinates,
states of the drive, force laws, steps per sample) and differ in everything else: parameters,
references, starts, sample times.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arm.signatures import filling, kernel, matrix
from ..compiler import int64, njit, types
from ..lanes.algebra import add_product, advance, combine, copy, multiply, read, write
from ..lanes.functions import INLINE
from ..lanes.wide import any_lane, get, put, select
from ..simulate.bristles import bound, friction_rates
from ..simulate.discrete import aligned
from ..simulate.elements import (
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


def drive_matrices(laws: Sequence[np.ndarray]) -> tuple[np.ndarray, ...]:
    """Of drives side by side, as `law_lanes` gives them (lanes, ..): feedback (nj + ns, 2 n + ns)
    from [q, q', s] and forward (nj + ns, nr) from r to [u, s'], and rates (ns, 2 n), the part of
    the feedback from [q, q'] to s'."""
    R, P, V, S, Fs, Fq, Fv, Fr = laws
    rates = np.concatenate([Fq, Fv], axis=2)
    torques = np.concatenate([P, V, S], axis=2)
    feedback = np.concatenate([-torques, np.concatenate([rates, Fs], axis=2)], axis=1)
    return feedback, np.concatenate([R, Fr], axis=1), rates


def implicit_parts(
    K: np.ndarray, D: np.ndarray, laws: Sequence[np.ndarray], h: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Constant matrices (A, B, T, inverse, A0, B0) of steps of length h (lanes,), g = gamma h.

    K and D (lanes, n, n) are the arms'; the drives' feedback is added here. The stage equations are
    (M + A) kv = M b - B a - T c, kq = a + g kv, ks = inverse (c + g (Fq kq + Fv kv)).
    A0 and B0 are those of the arm alone: the rows of a joint whose drive is at its limit.
    """
    _, P, V, S, Fs, Fq, Fv, _ = laws
    joints, (lanes, n) = P.shape[1], K.shape[:2]
    g = GAMMA * h[:, None, None]
    inverse = np.linalg.inv(np.eye(Fs.shape[1]) - g * Fs)
    A0, B0 = g * D + g * g * K, g * K
    K, D, T = K.copy(), D.copy(), np.zeros((lanes, n, Fs.shape[1]))
    K[:, :joints] += P
    D[:, :joints] += V
    T[:, :joints] = g * S @ inverse
    A = g * D + g * g * K + g * T @ (Fv + g * Fq)
    return A, g * K + g * T @ Fq, T, inverse, A0, B0


@njit(**{**INLINE, "_nrt": True})
def parts_of(y, n, ns):  # type: ignore[no-untyped-def]
    """[q, q', s, w] of a state or of its rates."""
    return y[:n], y[n : 2 * n], y[2 * n : 2 * n + ns], y[2 * n + ns :]


@njit(**INLINE)
def drive_response(law, r, state, response, joints):  # type: ignore[no-untyped-def]
    """response = [u, s'] of the drives at [q, q', s], u (nj,) cut at the limit."""
    feedback, forward, _, limit = law
    multiply(response, forward, r)
    add_product(response, 1.0, feedback, state)
    for i in range(joints):
        most, torque = get(limit, i), get(response, i)
        put(response, i, select(torque > most, most, select(torque < -most, -most, torque)))


@njit(**INLINE)
def without_feedback(cuts, M, parts, W, both, T):  # type: ignore[no-untyped-def]
    """A drive at its limit does not react: its rows of the step's matrices are the arm's own."""
    _, B, whole_T, inverse, A0, B0 = parts
    joints, n, ns = cuts.shape[0], rows_of(M), rows_of(inverse)
    for i in range(joints):
        sign = get(cuts, i)
        free = (sign < 0.5) & (sign > -0.5)
        for at in range(i * n, (i + 1) * n):
            put(W, at, select(free, get(W, at), get(M, at) + get(A0, at)))
            put(both, at, select(free, get(B, at), get(B0, at)))
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
def solve_stage(  # type: ignore[no-untyped-def]
    solvers, rates, inverse, step, elements, ports, g, b, d, w, back, kw1, late, k, moving
):
    """k of (I - g W) k = d, with b the mass matrix times the part of d that is q''; M + A stands
    already factored in W. Of bristles see core.simulate.bristles.solve_friction. `moving` are the
    [q, q'] of k."""
    W, both, T, M, M2 = step
    x, xd, out, slopes, work = ports
    a, _, c, cw = d
    kq, kv, ks, kw = k
    copy(kv, b)
    solvers[5](both, a, kv)
    add_known(elements, a, cw, slopes, kv)
    add_product(kv, -1.0, T, c)
    solvers[2](W, kv)
    if elements[7].size > 0:
        friction_rates(solvers, elements, W, M, M2, late, x, xd, out, g, w, back, kw1, work, kv, kw)
    combine(kq, a, g, kv)
    add_product(c, g, rates, moving)
    multiply(ks, inverse, c)
    state_stage(elements, cw, kv, slopes, kw)


@kernel(
    types.void(
        filling(matrix, 5), filling(matrix, 4),
        types.Tuple((int64, *[filling(matrix, count) for count in (2, 2, 2, 3, 3)])),
        matrix, types.UniTuple(matrix, 4), types.UniTuple(matrix, 6), WIDE_ELEMENTS,
        matrix, int64, matrix, matrix, int64, types.boolean, matrix, matrix,
        matrix,
    )
)  # fmt: skip
def integrate(  # type: ignore[no-untyped-def]  # noqa: PLR0913
    dynamics, tip, solvers, p, law, parts, packed, r, straight, y, dt, substeps, limited, states,
    torques, growth,
):  # fmt: skip
    """Fills states (N (2 n + ns + nw),) and drive torques (N nj,) at the N samples from the start
    y, which becomes the end. Returns (1,): by how much a pivot shrank at most, see
    core.arm.solvers.factor.

    Each number stands for LANES arms, and matrices lie row by row. `solvers` is the number n of
    coordinates with the functions of core.arm.solvers; p (np,); `law` is `drive_matrices` with the
    limits (nj,), `parts` is `implicit_parts`; r (N nr,), of each row the first `straight` run
    straight between samples, the others are held; dt (1,) in s; `limited` says whether any drive
    has a limit.
    """
    addresses, firsts, states_of, values_of, _, _, tips, bristles, loads = packed
    # The tip's directions and loads are written here, and other threads may run the same model.
    directions, values = packed[4].copy(), packed[5].copy()
    elements = (
        addresses, firsts, states_of, values_of, directions, values, tips, bristles, loads
    )  # fmt: skip
    n, joints, nw = solvers[0], law[3].shape[0], states_of[-1]
    K, Q, length = firsts[-1], bristles.size, y.shape[0]
    ns, samples = length - 2 * n - nw, torques.shape[0] // joints
    nr = r.shape[0] // samples
    x, xd, tip_at = aligned(K), aligned(K), aligned(2 + 2 * n)
    z, J = tip_at[:2], tip_at[2:]
    out = aligned(OUT_PER_PORT * K + OUT_PER_STATE * nw)
    slopes = (aligned(K), aligned(nw), aligned(nw), aligned(nw))
    work = (
        aligned(Q * n), aligned(Q * Q), aligned(Q), aligned(Q), aligned(Q), aligned(Q),
        aligned(n), aligned(n),
    )  # fmt: skip
    ports = (x, xd, out, slopes, work)
    M, M2, W = aligned(n * n), aligned(n * n), aligned(n * n)
    both, T = parts[1].copy(), parts[2].copy()
    step = (W, both, T, M, M2)
    here, d, d0, b = aligned(length), aligned(length), aligned(length), aligned(n)
    k1, k = aligned(length), aligned(length)
    at, right, rates = parts_of(here, n, ns), parts_of(d, n, ns), parts_of(k, n, ns)
    state, moving, w, kw1 = here[: 2 * n + ns], k[: 2 * n], y[2 * n + ns :], k1[2 * n + ns :]
    a, f, c, cw = right
    response, cuts = aligned(joints + ns), aligned(joints)
    u, drive_rates = response[:joints], response[joints:]
    now, slope = aligned(nr), aligned(nr)
    h = get(dt, 0) / substeps
    g = GAMMA * h
    # Both stages go through the same instructions, which halves the time to compile them; `late`
    # is no constant, for which Numba would compile what it calls twice.
    stage = 0
    copy(here, y)
    for sample in range(samples):
        write(states, sample * length, y)
        read(now, r, sample * nr)
        done = 0
        while done < substeps:
            late = stage == 1
            drive_response(law, now, state, response, joints)
            if done == 0 and not late:
                write(torques, sample * joints, u)
                if sample == samples - 1:
                    break
                for i in range(straight):
                    change = get(r, (sample + 1) * nr + i) - get(r, sample * nr + i)
                    put(slope, i, change / substeps)
            again = late and limited and release_drives(cuts, u, law[3])
            if again:
                late = False
                copy(here, y)
                copy(d, d0)
            else:
                copy(a, at[1])
                dynamics(at[0], at[1], p, M2, f)
                for i in range(joints):
                    put(f, i, get(f, i) + get(u, i))
                copy(c, drive_rates)
                if K > 0:
                    see(tip, elements, at[0], at[1], p, x, xd, z, J)
                    load(elements, u)
            if late:
                if K > 0:
                    push(elements, x, xd, at[3], out, f, cw)
                solvers[3](M2, f)
                combine(d, d, -2.0, k1)
                solvers[4](M, f, b)
            else:
                if not again:
                    copy(d0, d)
                    copy(M, M2)
                    if limited:
                        cut_drives(cuts, u, law[3])
                combine(W, M, 1.0, parts[0])
                if limited:
                    without_feedback(cuts, M, parts, W, both, T)
                if K > 0:
                    push_implicitly(elements, x, xd, at[3], out, f, cw, g, W, slopes)
                solvers[1](W, growth)
                copy(b, f)
            back = g * (2.0 if late else 0.0)
            solve_stage(
                solvers, law[2], parts[3], step, elements, ports, g, b, right, at[3], back, kw1,
                late, rates, moving,
            )  # fmt: skip
            if late:
                advance(y, 1.5 * h, k1, 0.5 * h, k)
                if Q > 0:
                    bound(bristles, states_of, w)
                copy(here, y)
                done += 1
            else:
                copy(k1, k)
                combine(here, y, h, k)
                if not again:
                    combine(now, now, 1.0, slope)
            stage = 0 if late else 1
