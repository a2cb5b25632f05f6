"""Vector instructions for compiled code: one vector is the same number of LANES systems.

Numba's compiler does not turn short loops over the lanes into vector instructions, because it
cannot know that the arrays do not overlap. These intrinsics say it outright; the compiler
splits the vectors where the machine's registers are shorter.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

LANES = 8
"""Doubles in a 512-bit register."""

_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_ZERO = ir.Constant(_VECTOR, [0.0] * LANES)
_FUSE = ("contract",)


def _data(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    return context.make_array(kind)(context, builder, array).data


def _at(builder: Any, data: Any, index: Any) -> Any:
    return builder.bitcast(builder.gep(data, [index]), _VECTOR.as_pointer())


def _accumulate(
    builder: Any, A: Any, a: Any, rowstride: Any, x: Any, count: Any, sums: list
) -> list:
    """Emits a loop: sums[r] += A[a + r rowstride + 8 k] x[k], for k below count."""
    array, start, step = x
    whole = a.type
    before = builder.block
    loop, after = builder.append_basic_block("dot"), builder.append_basic_block("dotted")
    none = builder.icmp_signed("<=", count, ir.Constant(whole, 0))
    builder.cbranch(none, after, loop)
    builder.position_at_end(loop)
    k = builder.phi(whole)
    k.add_incoming(ir.Constant(whole, 0), before)
    phis = []
    for value in sums:
        phi = builder.phi(_VECTOR)
        phi.add_incoming(value, before)
        phis.append(phi)
    at = builder.add(start, builder.mul(k, step))
    factor = builder.load(_at(builder, array, at), align=8)
    offset = builder.add(a, builder.mul(k, ir.Constant(whole, LANES)))
    totals = []
    for r, phi in enumerate(phis):
        row = builder.add(offset, builder.mul(rowstride, ir.Constant(whole, r)))
        term = builder.fmul(builder.load(_at(builder, A, row), align=8), factor, flags=_FUSE)
        totals.append(builder.fadd(term, phi, flags=_FUSE))
    following = builder.add(k, ir.Constant(whole, 1))
    k.add_incoming(following, loop)
    for phi, total in zip(phis, totals, strict=True):
        phi.add_incoming(total, loop)
    builder.cbranch(builder.icmp_signed("<", following, count), loop, after)
    builder.position_at_end(after)
    results = []
    for value, total in zip(sums, totals, strict=True):
        phi = builder.phi(_VECTOR)
        phi.add_incoming(value, before)
        phi.add_incoming(total, loop)
        results.append(phi)
    return results


def _make_dot(rows: int) -> Any:
    @intrinsic
    def dot(typingctx, A, a, stride, x, x0, xs, n, w, w0, m, y, y0, ys):  # type: ignore[no-untyped-def]
        """y[y0 + r ys] = sum_k<n A[a + r stride + 8 k] x[x0 + k xs]
        + sum_k<m A[.. + 8 (n + k)] w[w0 + 8 k].

        For r below `rows`; all arrays flat float64, all places and strides in doubles.
        """
        signature = types.void(A, a, stride, x, x0, xs, n, w, w0, m, y, y0, ys)

        def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
            kinds = sig.args
            matrix = _data(context, builder, kinds[0], args[0])
            first = (_data(context, builder, kinds[3], args[3]), args[4], args[5])
            whole = args[1].type
            lanes = ir.Constant(whole, LANES)
            second = (_data(context, builder, kinds[7], args[7]), args[8], lanes)
            out = _data(context, builder, kinds[10], args[10])
            sums = _accumulate(builder, matrix, args[1], args[2], first, args[6], [_ZERO] * rows)
            later = builder.add(args[1], builder.mul(args[6], lanes))
            sums = _accumulate(builder, matrix, later, args[2], second, args[9], sums)
            for r, value in enumerate(sums):
                place = builder.add(args[11], builder.mul(args[12], ir.Constant(whole, r)))
                builder.store(value, _at(builder, out, place), align=8)
            return context.get_dummy_value()

        return signature, emit

    return dot


dot1, dot2, dot4 = _make_dot(1), _make_dot(2), _make_dot(4)


def _add_squares(typingctx, y, y0, measured, m0, weights, w0, total, t0):  # type: ignore[no-untyped-def]
    """total[t0 + lane] += weights[w0 + lane] (measured[m0 + lane] - y[y0 + lane])^2."""
    signature = types.void(y, y0, measured, m0, weights, w0, total, t0)

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        def vector(i):  # type: ignore[no-untyped-def]
            return _at(builder, _data(context, builder, sig.args[i], args[i]), args[i + 1])

        values = [builder.load(vector(i), align=8) for i in (0, 2, 4, 6)]
        error = builder.fsub(values[1], values[0])
        weighted = builder.fmul(values[2], error)
        square = builder.fmul(weighted, error, flags=_FUSE)
        builder.store(builder.fadd(square, values[3], flags=_FUSE), vector(6), align=8)
        return context.get_dummy_value()

    return signature, emit


def _axpy(typingctx, y, y0, scale, x, x0):  # type: ignore[no-untyped-def]
    """y[y0 + lane] += scale x[x0 + lane]."""
    signature = types.void(y, y0, scale, x, x0)

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        out = _at(builder, _data(context, builder, sig.args[0], args[0]), args[1])
        x = _at(builder, _data(context, builder, sig.args[3], args[3]), args[4])
        spread = builder.insert_element(_ZERO, args[2], ir.Constant(ir.IntType(32), 0))
        mask = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
        factor = builder.shuffle_vector(spread, ir.Constant(_VECTOR, ir.Undefined), mask)
        term = builder.fmul(builder.load(x, align=8), factor, flags=_FUSE)
        total = builder.fadd(term, builder.load(out, align=8), flags=_FUSE)
        builder.store(total, out, align=8)
        return context.get_dummy_value()

    return signature, emit


# Any: the type checker would ask for the typing context that Numba adds by itself.
add_squares: Any = intrinsic(_add_squares)
axpy: Any = intrinsic(_axpy)
