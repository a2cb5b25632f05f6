"""Dry friction of LANES arms side by side: core.simulate.bristles with wide numbers.

A lane that has its answer keeps it while the others go on.
"""

from __future__ import annotations

from numba import njit

from core.lanes.algebra import substitute_positive
from core.lanes.functions import INLINE
from core.lanes.wide import absolute, any_lane, get, maximum, minimum, put, select, spread
from core.simulate.bristles import MISS, SWEEPS, TRIES
from core.simulate.wide_elements import call_wide_element


@njit(**INLINE)
def answer(bristles, ports, directions, W, M, M2, late, substitute, multiply, col, row, columns, D):  # type: ignore[no-untyped-def]
    """columns (B n,) of accelerations to a force of one, and D (B, B) along the ports.

    In the second stage the force meets the mass matrix there: M2 in its factors.
    """
    n, count = col.shape[0], bristles.size
    for i in range(count):
        at = ports[bristles[i]]
        for a in range(n):
            put(col, a, get(directions, at * n + a))
        if late:
            substitute_positive(M2, n, col)
            multiply(M, col, row)
            for a in range(n):
                put(col, a, get(row, a))
        substitute(W, col)
        for a in range(n):
            put(columns, i * n + a, get(col, a))
        for j in range(count):
            at = ports[bristles[j]]
            along = spread(0.0)
            for a in range(n):
                along += get(directions, at * n + a) * get(col, a)
            put(D, j * count + i, along)


@njit(**INLINE)
def within(share):  # type: ignore[no-untyped-def]
    """The share cut to [-1, 1]."""
    return minimum(maximum(share, -1.0), 1.0)


@njit(**INLINE)
def slip(address, x, port, V, i, S, values, at, out, base, rest, own, g, F, active):  # type: ignore[no-untyped-def]
    """The force F[i] of one bristle, with its V[i] and S[i], the others' forces being in `rest`.

    Newton's method within a bracket, begun as if it went on slipping; only the `active` lanes move.
    """
    low, high = spread(-1e300), spread(1e300)
    state, force = get(S, i), get(F, i)
    speed = select(active, rest + own * force, get(V, i))
    put(V, i, speed)
    open_ = active
    tried = 0
    while tried < TRIES and any_lane(open_):
        call_wide_element(address, x, port, V, i, S, i, values, at, out)
        share = 1.0 / (1.0 - g * get(out, 6))
        bent = (base + g * (get(out, 3) - get(out, 6) * state)) * share
        pushed = get(out, 0) + get(out, 4) * (bent - state)
        force = select(open_, pushed, force)
        state = select(open_, bent, state)
        miss = speed - rest - own * force
        open_ = open_ & (absolute(miss) > MISS)
        high = select(open_ & (miss > 0.0), speed, high)
        low = select(open_ & (miss < 0.0), speed, low)
        slope = get(out, 2) + get(out, 4) * g * get(out, 5) * share
        newton = speed - miss / maximum(1.0 - own * slope, 1.0)
        inside = (low < newton) & (newton < high)
        speed = select(open_, select(inside, newton, 0.5 * (low + high)), speed)
        put(V, i, speed)
        put(S, i, state)
        tried += 1
    put(F, i, force)


@njit(**INLINE)
def free_speeds(bristles, ports, directions, xd, g, kv, free):  # type: ignore[no-untyped-def]
    """V (B,) of a stage without any bristle's force."""
    n = kv.shape[0]
    for i in range(bristles.size):
        at = ports[bristles[i]]
        rate = spread(0.0)
        for a in range(n):
            rate += get(directions, at * n + a) * get(kv, a)
        put(free, i, get(xd, at) + g * rate)


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
    most = spread(0.0)
    for j in range(count):
        if j != i:
            most = maximum(most, absolute(g * get(D, j * count + i) * change))
    return most


@njit(**INLINE)
def apply_forces(bristles, states, columns, F, S, w, g, kv, kw):  # type: ignore[no-untyped-def]
    """kv += what the forces do; kw the rates that lead from w to S."""
    n = kv.shape[0]
    for i in range(bristles.size):
        at = states[bristles[i]]
        put(kw, at, (get(S, i) - get(w, at)) / g)
        force = get(F, i)
        for a in range(n):
            put(kv, a, get(kv, a) + get(columns, i * n + a) * force)


@njit(**INLINE)
def solve_friction(  # type: ignore[no-untyped-def]
    bristles, addresses, ports, states, parameters, values, D, g, x, w, back, kw1, free, V, F, S,
    out,
):  # fmt: skip
    """The forces F (B,) of all bristles in one stage, with their speeds V and states S.

    `w` are the states from which the stage's rates are counted; it stands on those `back` times
    the rates kw1 before them. F is where the search begins: what it was in the stage before.
    """
    count, swept = bristles.size, 0
    active = spread(1.0) > 0.0
    while any_lane(active) and swept < SWEEPS:
        moved = spread(0.0)
        for i in range(count):
            e = bristles[i]
            base = within(get(w, states[e]) - back * get(kw1, states[e]))
            before = get(F, i)
            slip(
                addresses[e], x, ports[e], V, i, S, values, parameters[e], out, base,
                others(D, F, free, i, g), g * get(D, i * count + i), g, F, active,
            )  # fmt: skip
            moved = maximum(moved, furthest(D, i, count, get(F, i) - before, g))
        active = active & (moved > MISS)
        swept += 1


@njit(**INLINE)
def bound(bristles, states, w):  # type: ignore[no-untyped-def]
    """A bristle that slips within the step would be carried beyond its end."""
    for i in range(bristles.size):
        at = states[bristles[i]]
        put(w, at, within(get(w, at)))
