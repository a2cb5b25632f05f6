"""Drives inside a step: what they apply, and limits of torque that cut it.

A drive at its limit does not react to the motion: its rows of the step's matrix are the arm's own.
All is written for LANES arms side by side (core.lanes.wide).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..compiler import njit
from ..lanes.algebra import add_product, multiply
from ..lanes.functions import INLINE
from ..lanes.wide import any_lane, get, put, select


def drive_matrices(laws: Sequence[np.ndarray], inputs: int) -> tuple[np.ndarray, ...]:
    """Of drives side by side, as `law_lanes` gives them (lanes, ..): feedback (nj + ns, 2 n + ns)
    from [q, q', s] and forward (nj + ns, inputs + nr) from r to [u, s'], and rates (ns, 2 n), the
    part of the feedback from [q, q'] to s'. A drive does not see the inputs."""
    R, P, V, S, Fs, Fq, Fv, Fr = laws
    rates = np.concatenate([Fq, Fv], axis=2)
    torques = np.concatenate([P, V, S], axis=2)
    feedback = np.concatenate([-torques, np.concatenate([rates, Fs], axis=2)], axis=1)
    forward = np.concatenate([R, Fr], axis=1)
    forward = np.pad(forward, ((0, 0), (0, 0), (inputs, 0)))
    return feedback, forward, rates


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
