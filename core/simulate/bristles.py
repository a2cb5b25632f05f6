"""Dry friction inside a step: bristles are solved for together with the speed that bends them.

A joint's speed can turn round within one step, and a bristle's slope says nothing beyond its
breakaway displacement: a linearised one overshoots, and the simulation comes apart. So in each
stage the force of a bristle is what it is at the stage's own speed and state,

    V_i = rest_i + g sum_j D_ij F_j(V_j, w_j),    w_j = base_j + g rate_j(V_j, w_j),

with D the answer of the step's matrix to a force of one. A few numbers per joint are unknown, so
the matrix is factored once as before. The two stages are those of the L-stable, algebraically
stable SDIRK method that ROS2 is for linear forces: second order, and no stage gains energy.
States are shares in [-1, 1]. The functions are short because Numba counts references to arrays
in longer ones, which took three times as long as the arithmetic.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from core.simulate.elements import call_element
from core.simulate.small import (
    INLINE,
    multiply,
    substitute,
    substitute_positive,
)

MISS = 1e-11
"""rad/s or m/s: of a stage's speed. Bristles turn it into 1e-9 of their force."""

TRIES = 60
"""Halving a bracket that often ends at rounding; Newton's steps need two or three."""

SWEEPS = 40
"""Over the bristles, each solved with the others' forces given; two or three are needed."""


@njit(**INLINE)
def answer(bristles, ports, directions, W, pivots, M, M2, late, col, row, columns, D):  # type: ignore[no-untyped-def]
    """columns (B, n) of accelerations to a force of one, and D (B, B) along the ports.

    In the second stage the force meets the mass matrix there: M2 in its factors.
    """
    for i in range(bristles.size):
        at = ports[bristles[i]]
        for a in range(col.size):
            col[a] = directions[at, a]
        if late:
            substitute_positive(M2, col)
            multiply(row, M, col)
            for a in range(col.size):
                col[a] = row[a]
        substitute(W, pivots, col)
        for a in range(col.size):
            columns[i, a] = col[a]
        for j in range(bristles.size):
            at = ports[bristles[j]]
            along = 0.0
            for a in range(col.size):
                along += directions[at, a] * col[a]
            D[j, i] = along


@njit(**INLINE)
def within(share):  # type: ignore[no-untyped-def]
    """The share cut to [-1, 1]."""
    return min(max(share, -1.0), 1.0)


@njit(**INLINE)
def slip(address, x, port, V, i, S, values, at, out, base, rest, own, g, F):  # type: ignore[no-untyped-def]
    """The force F[i] of one bristle, with its V[i] and S[i], the others' forces being in `rest`.

    Newton's method within a bracket, begun as if it went on slipping.
    """
    low, high, miss = -1e300, 1e300, np.inf
    tried = 0
    V[i] = rest + own * F[i]
    while abs(miss) > MISS and tried < TRIES:
        call_element(address, x, port, V, i, S, i, values, at, out)
        share = 1.0 / (1.0 - g * out[6])
        bent = (base + g * (out[3] - out[6] * S[i])) * share
        F[i] = out[0] + out[4] * (bent - S[i])
        S[i] = bent
        miss = V[i] - rest - own * F[i]
        if abs(miss) > MISS:
            high = V[i] if miss > 0.0 else high
            low = V[i] if miss < 0.0 else low
            slope = out[2] + out[4] * g * out[5] * share
            step = miss / max(1.0 - own * slope, 1.0)
            inside = low < V[i] - step < high
            V[i] = V[i] - step if inside else 0.5 * (low + high)
        tried += 1


@njit(**INLINE)
def free_speeds(bristles, ports, directions, xd, g, kv, free):  # type: ignore[no-untyped-def]
    """V (B,) of a stage without any bristle's force."""
    for i in range(bristles.size):
        at = ports[bristles[i]]
        rate = 0.0
        for a in range(kv.size):
            rate += directions[at, a] * kv[a]
        free[i] = xd[at] + g * rate


@njit(**INLINE)
def others(D, F, free, i, g):  # type: ignore[no-untyped-def]
    """The speed of bristle i with the forces of all others."""
    total = free[i]
    for j in range(F.size):
        total += g * D[i, j] * F[j] if j != i else 0.0
    return total


@njit(**INLINE)
def furthest(D, i, change, g):  # type: ignore[no-untyped-def]
    """By how much a change of force i moves another bristle's speed at most."""
    most = 0.0
    for j in range(D.shape[0]):
        most = max(most, abs(g * D[j, i] * change) if j != i else 0.0)
    return most


@njit(**INLINE)
def apply_forces(bristles, states, columns, F, S, w, g, kv, kw):  # type: ignore[no-untyped-def]
    """kv += what the forces do; kw the rates that lead from w to S."""
    for i in range(bristles.size):
        at = states[bristles[i]]
        kw[at] = (S[i] - w[at]) / g
        for a in range(kv.size):
            kv[a] += columns[i, a] * F[i]


@njit(**INLINE)
def solve_friction(  # type: ignore[no-untyped-def]
    bristles, addresses, ports, states, parameters, values, D, g, x, w, back, kw1, free, V, F, S,
    out,
):  # fmt: skip
    """The forces F (B,) of all bristles in one stage, with their speeds V and states S.

    `w` are the states from which the stage's rates are counted; it stands on those `back` times
    the rates kw1 before them. F is where the search begins: what it was in the stage before.
    """
    moved, swept = np.inf, 0
    while moved > MISS and swept < SWEEPS:
        moved = 0.0
        for i in range(bristles.size):
            e = bristles[i]
            base = within(w[states[e]] - back * kw1[states[e]])
            before = F[i]
            slip(
                addresses[e], x, ports[e], V, i, S, values, parameters[e], out, base,
                others(D, F, free, i, g), g * D[i, i], g, F,
            )  # fmt: skip
            moved = max(moved, furthest(D, i, F[i] - before, g))
        swept += 1


@njit(**INLINE)
def bound(bristles, states, w):  # type: ignore[no-untyped-def]
    """A bristle that slips within the step would be carried beyond its end."""
    for i in range(bristles.size):
        w[states[bristles[i]]] = within(w[states[bristles[i]]])
