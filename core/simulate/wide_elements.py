"""Extra forces of LANES arms side by side: core.simulate.elements with wide numbers.

All lanes have the same laws through ports of the same kind; directions and parameters may differ.
An element is called by address with five pointers to rows of LANES doubles.
"""

from __future__ import annotations

from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

from core.arm.signatures import matrix
from core.lanes.functions import INLINE
from core.lanes.wide import LANES, get, put, spread
from core.simulate.elements import OUT_PER_PORT, integers

WIDE_ELEMENTS = types.Tuple(
    (
        integers, integers, integers, integers, matrix, matrix, integers, integers,
        types.int64[:, ::1],
    )
)  # fmt: skip
"""Addresses (E,), first port, state and parameter (E + 1,), directions (K n, LANES), parameters
(count, LANES), first ports at the tip, which elements are bristles, and (joint, parameter) of those
that are told a drive's torque."""


@intrinsic
def call_wide_element(typingctx, address, x, x0, v, v0, w, w0, e, e0, out):  # type: ignore[no-untyped-def]
    """Calls the C function at an address with the rows from x0, v0, w0, e0 on."""
    signature = types.void(address, x, x0, v, v0, w, w0, e, e0, out)

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        pointer = ir.DoubleType().as_pointer()
        function = ir.FunctionType(ir.VoidType(), [pointer] * 5)
        target = builder.inttoptr(args[0], function.as_pointer())
        pointers = []
        for at in (1, 3, 5, 7):
            data = context.make_array(sig.args[at])(context, builder, args[at]).data
            row = builder.mul(args[at + 1], ir.Constant(args[at + 1].type, LANES))
            pointers.append(builder.gep(data, [row]))
        data = context.make_array(sig.args[9])(context, builder, args[9]).data
        builder.call(target, [*pointers, data])
        return context.get_dummy_value()

    return signature, emit


@njit(**INLINE)
def see(tip, elements, q, v, p, x, xd, z, J):  # type: ignore[no-untyped-def]
    """Displacements x and rates xd (K,) of all ports; the tip's directions follow the posture."""
    directions, tips = elements[4], elements[6]
    n = q.shape[0]
    if tips.size > 0:
        tip(q, p, z, J)
    for at in tips:
        for i in range(2):
            for j in range(n):
                put(directions, (at + i) * n + j, get(J, i * n + j))
    for i in range(x.shape[0]):
        place, rate = spread(0.0), spread(0.0)
        for j in range(n):
            along = get(directions, i * n + j)
            place += along * get(q, j)
            rate += along * get(v, j)
        put(x, i, place)
        put(xd, i, rate)
    for at in tips:
        put(x, at, get(z, 0))
        put(x, at + 1, get(z, 1))


@njit(**INLINE)
def load(elements, u):  # type: ignore[no-untyped-def]
    """Tells loaded elements the drives' torques u (nj,)."""
    values, loads = elements[5], elements[8]
    for i in range(loads.shape[0]):
        put(values, loads[i, 1], get(u, loads[i, 0]))


@njit(**INLINE)
def push(elements, x, xd, w, out, f, dw):  # type: ignore[no-untyped-def]
    """f += the elements' forces; dw (nw,) the rates of their states."""
    addresses, ports, states, parameters, directions, values, _, bristles, _ = elements
    n = f.shape[0]
    for e in range(addresses.size - bristles.size):
        first, count = ports[e], ports[e + 1] - ports[e]
        w0, m = states[e], states[e + 1] - states[e]
        call_wide_element(addresses[e], x, first, xd, first, w, w0, values, parameters[e], out)
        for i in range(count):
            force = get(out, i)
            for j in range(n):
                put(f, j, get(f, j) + get(directions, (first + i) * n + j) * force)
        for i in range(m):
            put(dw, w0 + i, get(out, OUT_PER_PORT * count + i))


@njit(**INLINE)
def push_implicitly(elements, x, xd, w, out, f, dw, g, W, Fx, Fw, rv, rw):  # type: ignore[no-untyped-def]
    """As `push`; the slopes enter W (n, n) and are kept per port (Fx) and state (Fw, rv, rw)."""
    addresses, ports, states, parameters, directions, values, _, bristles, _ = elements
    n = f.shape[0]
    for e in range(addresses.size - bristles.size):
        first, count = ports[e], ports[e + 1] - ports[e]
        w0, m = states[e], states[e + 1] - states[e]
        call_wide_element(addresses[e], x, first, xd, first, w, w0, values, parameters[e], out)
        at = OUT_PER_PORT * count
        for i in range(count):
            slope = g * get(out, 2 * count + i) + g * g * get(out, count + i)
            put(Fx, first + i, g * get(out, count + i))
            if i < m:
                put(dw, w0 + i, get(out, at + i))
                share = g / (1.0 - g * get(out, at + 3 * m + i))
                put(rv, w0 + i, share * get(out, at + 2 * m + i))
                put(rw, w0 + i, share / g)
                put(Fw, w0 + i, g * get(out, at + m + i))
                slope += get(Fw, w0 + i) * get(rv, w0 + i)
            force = get(out, i)
            for a in range(n):
                towards = get(directions, (first + i) * n + a)
                put(f, a, get(f, a) + towards * force)
                for b in range(n):
                    along = get(directions, (first + i) * n + b)
                    put(W, a * n + b, get(W, a * n + b) - slope * towards * along)


@njit(**INLINE)
def add_known(elements, a, c, Fx, Fw, rw, kv):  # type: ignore[no-untyped-def]
    """What the right side of a stage gains: g dF/dx b.a and the states' own part along b."""
    ports, states, directions = elements[1], elements[2], elements[4]
    n = a.shape[0]
    for e in range(ports.size - 1 - elements[7].size):
        for i in range(ports[e + 1] - ports[e]):
            row = ports[e] + i
            known = spread(0.0)
            for j in range(n):
                known += get(directions, row * n + j) * get(a, j)
            known *= get(Fx, row)
            if i < states[e + 1] - states[e]:
                at = states[e] + i
                known += get(Fw, at) * get(rw, at) * get(c, at)
            for j in range(n):
                put(kv, j, get(kv, j) + known * get(directions, row * n + j))


@njit(**INLINE)
def state_stage(elements, c, kv, rv, rw, kw):  # type: ignore[no-untyped-def]
    """kw = (c + g drate/dv b.kv) / (1 - g drate/dw) of every state."""
    ports, states, directions = elements[1], elements[2], elements[4]
    n = kv.shape[0]
    for e in range(ports.size - 1 - elements[7].size):
        for i in range(states[e + 1] - states[e]):
            rate = spread(0.0)
            for j in range(n):
                rate += get(directions, (ports[e] + i) * n + j) * get(kv, j)
            at = states[e] + i
            put(kw, at, get(rw, at) * get(c, at) + get(rv, at) * rate)
