"""Extra forces in the integrator, called by address so that it is compiled once for all of them.

An element acts through ports. Port i sees the displacement x_i = b_i . q and its rate, and pushes
with F_i along b_i; the first m ports of an element carry one state each. A compiled element is

    element(x, v, w, e, out)

with displacements and rates (k,), states (m,), parameters e, and
out = [F (k), dF/dx (k), dF/dv (k), rate (m), dF/dw (m), drate/dv (m), drate/dw (m)].
The slopes go into the implicit part of the step, so steep friction and stiff contacts need no
small steps; ports' slopes on each other are left out, which costs no order (a W-method).
Bristles come last and are left to core.simulate.bristles: no slope says where they go.
"""

from __future__ import annotations

from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

from core.arm.signatures import matrix, vector
from core.simulate.small import INLINE

integers = types.int64[::1]
ELEMENTS = types.Tuple(
    (
        integers, integers, integers, integers, matrix, vector, integers, integers,
        types.int64[:, ::1],
    )
)  # fmt: skip
"""The arrays of core.forces.element.ElementArrays, in its order."""

OUT_PER_PORT = 3
OUT_PER_STATE = 4


@intrinsic
def call_element(typingctx, address, x, x0, v, v0, w, w0, e, e0, out):  # type: ignore[no-untyped-def]
    """Calls the C function at an address with five pointers into float64 arrays."""
    signature = types.void(address, x, x0, v, v0, w, w0, e, e0, out)

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        pointer = ir.DoubleType().as_pointer()
        function = ir.FunctionType(ir.VoidType(), [pointer] * 5)
        target = builder.inttoptr(args[0], function.as_pointer())
        pointers = []
        for at in (1, 3, 5, 7):
            data = context.make_array(sig.args[at])(context, builder, args[at]).data
            pointers.append(builder.gep(data, [args[at + 1]]))
        data = context.make_array(sig.args[9])(context, builder, args[9]).data
        builder.call(target, [*pointers, data])
        return context.get_dummy_value()

    return signature, emit


@njit(**INLINE)
def see(tip, elements, q, v, p, x, xd, z, J):  # type: ignore[no-untyped-def]
    """Displacements x and rates xd (K,) of all ports; the tip's directions follow the posture."""
    directions, tips = elements[4], elements[6]
    n = q.size
    if tips.size > 0:
        tip(q, p, z, J)
    for at in tips:
        for i in range(2):
            for j in range(n):
                directions[at + i, j] = J[i, j]
    for i in range(x.size):
        place, rate = 0.0, 0.0
        for j in range(n):
            place += directions[i, j] * q[j]
            rate += directions[i, j] * v[j]
        x[i], xd[i] = place, rate
    for at in tips:
        x[at], x[at + 1] = z[0], z[1]


@njit(**INLINE)
def load(elements, u):  # type: ignore[no-untyped-def]
    """Tells loaded elements the drives' torques u (nj,)."""
    values, loads = elements[5], elements[8]
    for i in range(loads.shape[0]):
        values[loads[i, 1]] = u[loads[i, 0]]


@njit(**INLINE)
def push(elements, x, xd, w, out, f, dw):  # type: ignore[no-untyped-def]
    """f += the elements' forces; dw (nw,) the rates of their states."""
    addresses, ports, states, parameters, directions, values, _, bristles, _ = elements
    for e in range(addresses.size - bristles.size):
        first, count = ports[e], ports[e + 1] - ports[e]
        w0, m = states[e], states[e + 1] - states[e]
        call_element(addresses[e], x, first, xd, first, w, w0, values, parameters[e], out)
        for i in range(count):
            for j in range(f.size):
                f[j] += directions[first + i, j] * out[i]
        for i in range(m):
            dw[w0 + i] = out[OUT_PER_PORT * count + i]


@njit(**INLINE)
def push_implicitly(elements, x, xd, w, out, f, dw, g, W, Fx, Fw, rv, rw):  # type: ignore[no-untyped-def]
    """As `push`; the slopes enter W (n, n) and are kept per port (Fx) and state (Fw, rv, rw)."""
    addresses, ports, states, parameters, directions, values, _, bristles, _ = elements
    for e in range(addresses.size - bristles.size):
        first, count = ports[e], ports[e + 1] - ports[e]
        w0, m = states[e], states[e + 1] - states[e]
        call_element(addresses[e], x, first, xd, first, w, w0, values, parameters[e], out)
        at = OUT_PER_PORT * count
        for i in range(count):
            slope = g * out[2 * count + i] + g * g * out[count + i]
            Fx[first + i] = g * out[count + i]
            if i < m:
                dw[w0 + i] = out[at + i]
                share = g / (1.0 - g * out[at + 3 * m + i])
                rv[w0 + i] = share * out[at + 2 * m + i]
                rw[w0 + i] = share / g
                Fw[w0 + i] = g * out[at + m + i]
                slope += Fw[w0 + i] * rv[w0 + i]
            for a in range(f.size):
                towards = directions[first + i, a]
                if towards != 0.0:
                    f[a] += towards * out[i]
                    for b in range(f.size):
                        W[a, b] -= slope * towards * directions[first + i, b]


@njit(**INLINE)
def add_known(elements, a, c, Fx, Fw, rw, kv):  # type: ignore[no-untyped-def]
    """What the right side of a stage gains: g dF/dx b.a and the states' own part along b."""
    ports, states, directions = elements[1], elements[2], elements[4]
    for e in range(ports.size - 1):
        for i in range(ports[e + 1] - ports[e]):
            row = ports[e] + i
            known = 0.0
            for j in range(a.size):
                known += directions[row, j] * a[j]
            known *= Fx[row]
            if i < states[e + 1] - states[e]:
                known += Fw[states[e] + i] * rw[states[e] + i] * c[states[e] + i]
            if known != 0.0:
                for j in range(a.size):
                    kv[j] += known * directions[row, j]


@njit(**INLINE)
def state_stage(elements, c, kv, rv, rw, kw):  # type: ignore[no-untyped-def]
    """kw = (c + g drate/dv b.kv) / (1 - g drate/dw) of every state."""
    ports, states, directions = elements[1], elements[2], elements[4]
    for e in range(ports.size - 1 - elements[7].size):
        for i in range(states[e + 1] - states[e]):
            rate = 0.0
            for j in range(kv.size):
                rate += directions[ports[e] + i, j] * kv[j]
            kw[states[e] + i] = rw[states[e] + i] * c[states[e] + i] + rv[states[e] + i] * rate
