"""Extra forces in the integrator, called by address so that it is compiled once for all of them.

An element acts through ports. Port i sees the displacement x_i = b_i . q and its rate, and pushes
with F_i along b_i; the first m ports of an element carry one state each. A compiled element is

    element(x, v, w, e, out)

with displacements and rates (k,), states (m,), parameters e, and
out = [F (k), dF/dx (k), dF/dv (k), rate (m), dF/dw (m), drate/dv (m), drate/dw (m)].
The slopes go into the implicit part of the step, so steep friction and stiff contacts need no
small steps; ports' slopes on each other are left out, which costs no order (a W-method).
Bristles come last and are left to core.simulate.bristles: no slope says where they go.

Numbers are those of one arm or of LANES side by side (core.lanes.wide), which have the same laws
through ports of the same kind and differ in directions and parameters.
"""

from __future__ import annotations

from llvmlite import ir

from ..arm.signatures import matrix, vector
from ..compiler import intrinsic, njit, types
from ..lanes.algebra import dot
from ..lanes.functions import INLINE
from ..lanes.wide import absolute, any_lane, get, put, row_pointer

OUT_PER_PORT = 3
OUT_PER_STATE = 4


def elements_of(numbers: types.Array) -> types.Tuple:
    """Of arrays of that type, in the order of core.forces.element.ElementArrays: addresses (E,),
    first port, state and parameter (E + 1,), directions (K n,), parameters, first ports at the tip,
    which elements are bristles, and (source, parameter) of what is written while simulating."""
    places = types.int64[::1]
    pairs = types.int64[:, ::1]
    return types.Tuple((*[places] * 4, numbers, numbers, places, places, pairs))


ELEMENTS, WIDE_ELEMENTS = elements_of(vector), elements_of(matrix)


@intrinsic
def call_element(typingctx, address, x, x0, v, v0, w, w0, e, e0, out):  # type: ignore[no-untyped-def]
    """Calls the C function at an address with the rows from x0, v0, w0, e0 on."""
    signature = types.void(address, x, x0, v, v0, w, w0, e, e0, out)

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        pointer = ir.DoubleType().as_pointer()
        function = ir.FunctionType(ir.VoidType(), [pointer] * 5)
        target = builder.inttoptr(args[0], function.as_pointer())
        first = ir.Constant(ir.IntType(64), 0)
        rows = [*((args[at], args[at + 1], sig.args[at]) for at in (1, 3, 5, 7))]
        rows.append((args[9], first, sig.args[9]))
        pointers = [row_pointer(context, builder, kind, array, row) for array, row, kind in rows]
        builder.call(target, [builder.bitcast(value, pointer) for value in pointers])
        return context.get_dummy_value()

    return signature, emit


@njit(**INLINE)
def see(tip, elements, q, v, p, x, xd, z, J):  # type: ignore[no-untyped-def]
    """Displacements x and rates xd (K,) of all ports; the tip's directions follow the posture."""
    ports, directions, tips = elements[1], elements[4], elements[6]
    n = q.shape[0]
    if tips.size > 0:
        tip(q, p, z, J)
    for at in tips:
        for i in range(2 * n):
            put(directions, at * n + i, get(J, i))
    for i in range(ports[-1]):
        put(x, i, dot(directions, i, q))
        put(xd, i, dot(directions, i, v))
    for at in tips:
        put(x, at, get(z, 0))
        put(x, at + 1, get(z, 1))


@njit(**INLINE)
def write_inputs(elements, u, r):  # type: ignore[no-untyped-def]
    """Passes elements the drives' torques u (nj,) and the signals r that they depend on."""
    values, loads = elements[5], elements[8]
    for i in range(loads.shape[0]):
        source = loads[i, 0] - u.shape[0]
        put(values, loads[i, 1], get(r, source) if source >= 0 else get(u, loads[i, 0]))


@njit(**INLINE)
def add_along(f, force, directions, row):  # type: ignore[no-untyped-def]
    """f (n,) += the force along a row of the directions."""
    n = f.shape[0]
    for j in range(n):
        put(f, j, get(f, j) + get(directions, row * n + j) * force)


@njit(**INLINE)
def push(elements, x, xd, w, out, f, dw):  # type: ignore[no-untyped-def]
    """f += the elements' forces; dw (nw,) the rates of their states."""
    addresses, ports, states, parameters, directions, values, _, bristles, _ = elements
    for e in range(addresses.size - bristles.size):
        first, count = ports[e], ports[e + 1] - ports[e]
        w0, m = states[e], states[e + 1] - states[e]
        call_element(addresses[e], x, first, xd, first, w, w0, values, parameters[e], out)
        for i in range(count):
            add_along(f, get(out, i), directions, first + i)
        for i in range(m):
            put(dw, w0 + i, get(out, OUT_PER_PORT * count + i))


@njit(**INLINE)
def push_implicitly(elements, x, xd, w, out, f, dw, g, W, slopes):  # type: ignore[no-untyped-def]
    """As `push`; the slopes enter W (n, n) and are kept per port (Fx) and state (Fw, rv, rw)."""
    addresses, ports, states, parameters, directions, values, _, bristles, _ = elements
    Fx, Fw, rv, rw = slopes
    n = f.shape[0]
    for e in range(addresses.size - bristles.size):
        first, count = ports[e], ports[e + 1] - ports[e]
        w0, m = states[e], states[e + 1] - states[e]
        call_element(addresses[e], x, first, xd, first, w, w0, values, parameters[e], out)
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
            add_along(f, get(out, i), directions, first + i)
            for a in range(n):
                towards = get(directions, (first + i) * n + a)
                if any_lane(absolute(towards) > 0.0):
                    for b in range(n):
                        along = get(directions, (first + i) * n + b)
                        put(W, a * n + b, get(W, a * n + b) - slope * towards * along)


@njit(**INLINE)
def add_known(elements, a, c, slopes, kv):  # type: ignore[no-untyped-def]
    """What the right side of a stage gains: g dF/dx b.a and the states' own part along b."""
    ports, states, directions = elements[1], elements[2], elements[4]
    Fx, Fw, _, rw = slopes
    for e in range(ports.size - 1 - elements[7].size):
        for i in range(ports[e + 1] - ports[e]):
            row = ports[e] + i
            force = dot(directions, row, a) * get(Fx, row)
            if i < states[e + 1] - states[e]:
                at = states[e] + i
                force += get(Fw, at) * get(rw, at) * get(c, at)
            add_along(kv, force, directions, row)


@njit(**INLINE)
def state_stage(elements, c, kv, slopes, kw):  # type: ignore[no-untyped-def]
    """kw = (c + g drate/dv b.kv) / (1 - g drate/dw) of every state."""
    ports, states, directions = elements[1], elements[2], elements[4]
    _, _, rv, rw = slopes
    for e in range(ports.size - 1 - elements[7].size):
        for i in range(states[e + 1] - states[e]):
            at = states[e] + i
            rate = dot(directions, ports[e] + i, kv)
            put(kw, at, get(rw, at) * get(c, at) + get(rv, at) * rate)
