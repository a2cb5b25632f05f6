"""The compiled non-linear simulator: a linearly implicit four-stage Rosenbrock-W method.

W, the approximate Jacobian, holds what is stiff: bending stiffness and damping and the drive's
feedback. So steps need not resolve poles of 10^5 rad/s. The forces are evaluated only twice, at
the start and two thirds along the first stage's rates; the later stages correct for what is stiff,

    (I - gamma h W) k_1 = f(y)
    (I - gamma h W) k_i = f(y + 2/3 h k_1) + sum_{j<i} c_ij k_j,    i = 2, 3, 4
    y+ = y + h sum_i m_i k_i.

It is of second order for any W and of third where W is exact, as for vibrations about a posture,
and L-stable. Its error of a vibration is a hundredth of that of two stages (ROS2) with the same
steps: gamma is the least with which four stages of this kind are stable for every pole, but for
three per cent (Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, table 6.4: .2237).
Seen as a Runge-Kutta method of the forces in W, it is algebraically stable: what damps or rubs
takes energy in every step (core.simulate.bristles).

It simulates LANES arms side by side (core.lanes.wide). The lanes have one structure (coordinates,
states of the drive, force laws, steps per sample) and differ in everything else: parameters,
references, starts, sample times.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arm.signatures import addresses, kernel, matrix, solvers_of, wide_dynamics_of, wide_tip_of
from ..compiler import int64, njit, types
from ..lanes.algebra import add_product, add_rows, combine, copy, multiply, read, write
from ..lanes.functions import INLINE
from ..lanes.wide import get, put
from ..simulate.bristles import bound, friction_rates
from ..simulate.discrete import aligned
from ..simulate.drive_limits import cut_drives, drive_response, release_drives, without_feedback
from ..simulate.elements import (
    OUT_PER_PORT,
    OUT_PER_STATE,
    WIDE_ELEMENTS,
    add_known,
    push,
    push_implicitly,
    see,
    state_stage,
    write_inputs,
)

GAMMA = 0.23

STAGES = 4
IMPLICIT = np.array(
    [
        [GAMMA, 0.0, 0.0, 0.0],
        [0.852565293050146834, GAMMA, 0.0, 0.0],
        [0.0791162051086424, -0.0567362485246330, GAMMA, 0.0],
        [0.166693137587180174, 0.00090381139944407, 0.372403045890526043, GAMMA],
    ]
)
"""beta_ij of the Runge-Kutta method that it is for forces in W; found by minimising the
coefficients subject to the properties above."""

SHARES = np.array([0.25, 0.0518508543984384, 0.2921192433392680, 0.4060299022622936])
"""b_i of the same; 1/4 and 3/4 at 2/3 are Radau's weights for what is evaluated twice."""

NODE = 2.0 / 3.0
"""Of a step: where the forces are evaluated the second time."""


def stage_coefficients() -> tuple[np.ndarray, np.ndarray]:
    """c_ij (4, 4) and m_i (4,) for stages that are sums of rates, so that no product with W is
    needed (Hairer and Wanner, section IV.7)."""
    explicit = np.zeros_like(IMPLICIT)
    explicit[1:, 0] = NODE
    sums = GAMMA * np.linalg.inv(IMPLICIT - explicit)
    return np.tril(np.eye(STAGES) - sums, -1), SHARES @ sums


COUPLINGS, WEIGHTS = stage_coefficients()


def time_rates() -> np.ndarray:
    """(4,) the stages of time, as one more state whose rate is one."""
    rates = np.ones(STAGES)
    for i in range(1, STAGES):
        rates[i] += COUPLINGS[i, :i] @ rates[:i]
    return rates


DRIFTS = GAMMA * time_rates()
"""(4,) the share of a step's change of what a signal applies that enters each stage, where the
signal runs straight between samples (Hairer and Wanner, section IV.7: non-autonomous problems)."""


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
def solve_stage(  # type: ignore[no-untyped-def]
    solvers, rates, inverse, step, elements, ports, g, b, d, w, stage, k, moving
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
        friction_rates(solvers, elements, W, M, M2, stage, x, xd, out, g, w, cw, work, kv, kw)
    combine(kq, a, g, kv)
    add_product(c, g, rates, moving)
    multiply(ks, inverse, c)
    state_stage(elements, cw, kv, slopes, kw)


@kernel(
    types.void(
        addresses, int64, matrix, types.UniTuple(matrix, 4), types.UniTuple(matrix, 6),
        WIDE_ELEMENTS, matrix, int64, matrix, matrix, int64, types.boolean, matrix, matrix, matrix,
    )
)  # fmt: skip
def integrate(  # type: ignore[no-untyped-def]  # noqa: PLR0913
    arm, n, p, law, parts, packed, r, straight, y, dt, substeps, limited, states, torques, growth
):  # fmt: skip
    """Fills states (N (2 n + ns + nw),) and drive torques (N nj,) at the N samples from the start
    y, which becomes the end, and `growth` (1,): by how much a pivot shrank at most, see
    core.arm.solvers.factor.

    Each number stands for LANES arms, and matrices lie row by row. `arm` (7,) are the addresses of
    its functions for n coordinates (core.arm.compiled.WideArm); p (np,); `law` is `drive_matrices`
    with the limits (nj,), `parts` is `implicit_parts`; r (N nr,), of each row the first `straight`
    run straight between samples, the others are held, and the first may be inputs of the elements;
    dt (1,) in s; `limited` says whether any drive has a limit.
    """
    dynamics, tip, solvers = wide_dynamics_of(arm), wide_tip_of(arm), solvers_of(arm, n)
    laws, firsts, states_of, values_of, _, _, tips, bristles, loads = packed
    # The tip's directions and loads are written here, and other threads may run the same model.
    directions, values = packed[4].copy(), packed[5].copy()
    elements = (
        laws, firsts, states_of, values_of, directions, values, tips, bristles, loads
    )  # fmt: skip
    joints, nw = law[3].shape[0], states_of[-1]
    K, Q, length = firsts[-1], bristles.size, y.shape[0]
    ns, samples = length - 2 * n - nw, torques.shape[0] // joints
    nr = r.shape[0] // samples
    x, xd, tip_at = aligned(K), aligned(K), aligned(2 + 2 * n)
    z, J = tip_at[:2], tip_at[2:]
    out = aligned(OUT_PER_PORT * K + OUT_PER_STATE * nw)
    slopes = (aligned(K), aligned(nw), aligned(nw), aligned(nw))
    guess = aligned(2 * Q)  # force and state where the search for each bristle's begins
    work = (
        aligned(Q * n), aligned(Q * Q), aligned(Q), aligned(Q), guess[:Q], guess[Q:], aligned(n),
        aligned(n),
    )  # fmt: skip
    ports = (x, xd, out, slopes, work)
    M, M2, W = aligned(n * n), aligned(n * n), aligned(n * n)
    both, T = aligned(n * n), aligned(n * ns)
    step = (W, both, T, M, M2)
    here, forces, d, b = aligned(length), aligned(length), aligned(length), aligned(n)
    stages, k = aligned(STAGES * length), aligned(length)
    at, found = parts_of(here, n, ns), parts_of(forces, n, ns)
    right, rates = parts_of(d, n, ns), parts_of(k, n, ns)
    state, moving, w = here[: 2 * n + ns], k[: 2 * n], y[2 * n + ns :]
    _, f, c, cw = found
    response, drift, cuts = aligned(joints + ns), aligned(joints + ns), aligned(joints)
    u, drive_rates = response[:joints], response[joints:]
    now, then, slope = aligned(nr), aligned(nr), aligned(nr)
    # All stages go through the same instructions, which take a fraction of the time to compile;
    # `stage` is no constant, for which Numba would compile what it calls several times.
    stage, released = 0, False
    h = get(dt, 0) / substeps
    g = GAMMA * h
    copy(here, y)
    for sample in range(samples):
        write(states, sample * length, y)
        read(now, r, sample * nr)
        copy(then, now)
        done = 0
        while done < substeps:
            if stage < 2:
                drive_response(law, then, state, response, joints)
                if stage == 0 and done == 0:
                    write(torques, sample * joints, u)
                    if sample == samples - 1:
                        break
                    for i in range(straight):
                        change = get(r, (sample + 1) * nr + i) - get(r, sample * nr + i)
                        put(slope, i, change / substeps)
                    multiply(drift, law[1], slope)
                if stage == 1 and limited and release_drives(cuts, u, law[3]):
                    stage, released = 0, True
                    copy(here, y)
                    copy(then, now)
                    continue
                copy(found[0], at[1])
                dynamics(at[0], at[1], p, M2, f)
                for i in range(joints):
                    put(f, i, get(f, i) + get(u, i))
                copy(c, drive_rates)
                if K > 0:
                    see(tip, elements, at[0], at[1], p, x, xd, z, J)
                    write_inputs(elements, u, then)
            if stage == 0:
                copy(M, M2)
                copy(both, parts[1])
                copy(T, parts[2])
                if limited and not released:
                    cut_drives(cuts, u, law[3])
                combine(W, M, 1.0, parts[0])
                if limited:
                    without_feedback(cuts, M, parts, W, both, T)
                if K > 0:
                    push_implicitly(elements, x, xd, at[3], out, f, cw, g, W, slopes)
                solvers[1](W, growth)
                copy(d, forces)
                copy(b, f)
            else:
                if stage == 1:
                    if K > 0:
                        push(elements, x, xd, at[3], out, f, cw)
                    solvers[3](M2, f)
                copy(d, forces)
                for j in range(stage):
                    add_rows(d, COUPLINGS[stage, j], stages, j * length)
                solvers[4](M, right[1], b)
            for i in range(joints):
                put(b, i, get(b, i) + DRIFTS[stage] * get(drift, i))
            for i in range(ns):
                put(right[2], i, get(right[2], i) + DRIFTS[stage] * get(drift, joints + i))
            solve_stage(
                solvers, law[2], parts[3], step, elements, ports, g, b, right, at[3], stage, rates,
                moving,
            )  # fmt: skip
            write(stages, stage * length, k)
            stage += 1
            if stage == 1:
                combine(here, y, NODE * h, k)
                combine(then, now, NODE, slope)
            if stage < STAGES:
                continue
            for j in range(STAGES):
                add_rows(y, WEIGHTS[j] * h, stages, j * length)
            if Q > 0:
                bound(bristles, states_of, w)
            combine(now, now, 1.0, slope)
            stage, released = 0, False
            done += 1
            copy(here, y)
            copy(then, now)
