"""Dry friction inside a step: bristles are solved for together with the speed that bends them.

A joint's speed can turn round within one step, and a bristle's slope says nothing beyond its
breakaway displacement: a linearised one overshoots, and the simulation comes apart. So in each
stage the force of a bristle is what it is at the stage's own speed and state,

    V_i = rest_i + g sum_j D_ij F_j(V_j, w_j),    w_j = base_j + g rate_j(V_j, w_j),

with D the answer of the step's matrix to a force of one. A few numbers per joint are unknown, so
the matrix is factored once as before. The stages are those of the L-stable, algebraically stable
SDIRK method that core.simulate.rosenbrock is for linear forces, so that no step gains energy.
States are shares in [-1, 1].

Of LANES arms side by side (core.lanes.wide) a lane that has its answer keeps it while others go on.
"""

from __future__ import annotations

import numpy as np

from ..compiler import njit
from ..lanes.algebra import copy, dot, read, substitute_positive, write
from ..lanes.functions import INLINE
from ..lanes.wide import absolute, any_lane, get, maximum, minimum, put, select
from ..simulate.elements import add_along, call_element

MISS = 1e-11
"""rad/s or m/s: of a stage's speed. Bristles turn it into 1e-9 of their force."""

TRIES = 60
"""Halving a bracket that often ends at rounding; Newton's steps need two or three."""

SWEEPS = 40
"""Over the bristles, each solved with the others' forces given; two or three are needed."""


@njit(**INLINE)
def answer(solvers, bristles, ports, directions, W, M, M2, stage, col, row, columns, D):  # type: ignore[no-untyped-def]
    """columns (B n,) of accelerations to a force of one, and D (B B,) along the ports.

    From the second stage on the force meets the mass matrix there: M2 in its factors.
    """
    n, count = col.shape[0], bristles.size
    for i in range(count):
        read(col, directions, ports[bristles[i]] * n)
        if stage > 0:
            substitute_positive(M2, n, col)
            solvers[4](M, col, row)
            copy(col, row)
        solvers[2](W, col)
        write(columns, i * n, col)
        for j in range(count):
            put(D, j * count + i, dot(directions, ports[bristles[j]], col))


@njit(**INLINE)
def within(share):  # type: ignore[no-untyped-def]
    """The share cut to [-1, 1]."""
    return minimum(maximum(share, -1.0), 1.0)


@njit(**INLINE)
def slip(address, x, port, V, i, S, values, at, out, base, others, own, g, F, active):  # type: ignore[no-untyped-def]
    """The force F[i] of one bristle, with its V[i] and S[i], the others' forces being in `others`.

    Newton's method within a bracket, begun as if it went on slipping; only the `active` lanes move.
    """
    low, high = -1e300, 1e300
    state, force = get(S, i), get(F, i)
    speed = select(active, others + own * force, get(V, i))
    put(V, i, speed)
    count = 0
    while count < TRIES and any_lane(active):
        call_element(address, x, port, V, i, S, i, values, at, out)
        share = 1.0 / (1.0 - g * get(out, 6))
        bent = (base + g * (get(out, 3) - get(out, 6) * state)) * share
        force = select(active, get(out, 0) + get(out, 4) * (bent - state), force)
        state = select(active, bent, state)
        put(S, i, state)
        miss = speed - others - own * force
        active = active & (absolute(miss) > MISS)
        if any_lane(active):
            high = select(active & (miss > 0.0), speed, high)
            low = select(active & (miss < 0.0), speed, low)
            slope = get(out, 2) + get(out, 4) * g * get(out, 5) * share
            newton = speed - miss / maximum(1.0 - own * slope, 1.0)
            inside = (low < newton) & (newton < high)
            speed = select(active, select(inside, newton, 0.5 * (low + high)), speed)
            put(V, i, speed)
        count += 1
    put(F, i, force)


@njit(**INLINE)
def free_speeds(bristles, ports, directions, xd, g, kv, free):  # type: ignore[no-untyped-def]
    """V (B,) of a stage without any bristle's force."""
    for i in range(bristles.size):
        at = ports[bristles[i]]
        put(free, i, get(xd, at) + g * dot(directions, at, kv))


@njit(**INLINE)
def others(D, F, free, i, g):  # type: ignore[no-untyped-def]
    """The speed of bristle i with the forces of all others."""
    total, count = get(free, i), F.shape[0]
    for j in range(count):
        if j != i:
            total += g * get(D, i * count + j) * get(F, j)
    return total


@njit(**INLINE)
def furthest(D, i, count, change, g):  # type: ignore[no-untyped-def]
    """By how much a change of force i moves another bristle's speed at most."""
    most = 0.0
    for j in range(count):
        if j != i:
            most = maximum(most, absolute(g * get(D, j * count + i) * change))
    return most


@njit(**INLINE)
def apply_forces(bristles, states, columns, F, S, w, g, kv, kw):  # type: ignore[no-untyped-def]
    """kv += what the forces do; kw the rates that lead from w to S."""
    for i in range(bristles.size):
        at = states[bristles[i]]
        put(kw, at, (get(S, i) - get(w, at)) / g)
        add_along(kv, get(F, i), columns, i)


@njit(**INLINE)
def solve_friction(  # type: ignore[no-untyped-def]
    bristles, addresses, ports, states, parameters, values, D, g, x, w, known, free, V, F, S, out,
):  # fmt: skip
    """The forces F (B,) of all bristles in one stage, with their speeds V and states S.

    `w` are the states from which the stage's rates are counted, `known` the part of these rates
    that earlier stages give. F is where the search begins: what it was in the stage before.
    """
    count, swept, moved = bristles.size, 0, np.inf
    while swept < SWEEPS and any_lane(moved > MISS):
        active = moved > MISS
        moved = 0.0
        for i in range(count):
            e = bristles[i]
            base = within(get(w, states[e]) + g * get(known, states[e]))
            before = get(F, i)
            slip(
                addresses[e], x, ports[e], V, i, S, values, parameters[e], out, base,
                others(D, F, free, i, g), g * get(D, i * count + i), g, F, active,
            )  # fmt: skip
            moved = maximum(moved, furthest(D, i, count, get(F, i) - before, g))
        swept += 1


@njit(**INLINE)
def bound(bristles, states, w):  # type: ignore[no-untyped-def]
    """A bristle that slips within the step would be carried beyond its end."""
    for i in range(bristles.size):
        at = states[bristles[i]]
        put(w, at, within(get(w, at)))


@njit(**INLINE)
def friction_rates(  # type: ignore[no-untyped-def]
    solvers, elements, W, M, M2, stage, x, xd, out, g, w, known, work, kv, kw
):
    """Puts the bristles' forces into the rates kv of a stage and gives the rates kw of their
    states; `work` is kept from stage to stage: columns, D, V without forces, V, F, S, and two (n,).
    """
    addresses, ports, states, parameters, directions, values, _, bristles, _ = elements
    columns, D, free, speed, force, share, col, row = work
    if stage < 2:
        answer(solvers, bristles, ports, directions, W, M, M2, stage, col, row, columns, D)
    free_speeds(bristles, ports, directions, xd, g, kv, free)
    solve_friction(
        bristles, addresses, ports, states, parameters, values, D, g, x, w, known, free, speed,
        force, share, out,
    )  # fmt: skip
    apply_forces(bristles, states, columns, force, share, w, g, kv, kw)
