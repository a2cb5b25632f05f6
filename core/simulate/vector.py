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


def _one_vector(builder: Any, x: Any, k: Any) -> Any:
    """x[8 k], one number per lane."""
    place = builder.mul(k, ir.Constant(k.type, LANES))
    return builder.load(_at(builder, x, place), align=8)


def _one_number(builder: Any, x: Any, k: Any) -> Any:
    """x[k], the same number in all lanes."""
    return _in_all_lanes(builder, builder.load(builder.gep(x, [k])))


def _in_all_lanes(builder: Any, number: Any) -> Any:
    first = builder.insert_element(_ZERO, number, ir.Constant(ir.IntType(32), 0))
    mask = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(first, ir.Constant(_VECTOR, ir.Undefined), mask)


def _columns(
    builder: Any, A: Any, stride: Any, x: Any, count: Any, sums: list[Any], combine: Any,
    entry: Any = _one_vector,
) -> list[Any]:  # fmt: skip
    """Emits a loop: sums[r] = combine(sums[r], A[k stride + 8 r] entry(x, k)), for k below count
    (at least 1)."""
    whole = count.type
    before = builder.block
    loop, after = builder.append_basic_block("dot"), builder.append_basic_block("dotted")
    builder.branch(loop)
    builder.position_at_end(loop)
    k = builder.phi(whole)
    k.add_incoming(ir.Constant(whole, 0), before)
    phis = [builder.phi(_VECTOR) for _ in sums]
    for phi, value in zip(phis, sums, strict=True):
        phi.add_incoming(value, before)
    factor = entry(builder, x, k)
    column = builder.gep(A, [builder.mul(k, stride)])
    totals = []
    for r, phi in enumerate(phis):
        one = builder.load(_at(builder, column, ir.Constant(whole, r * LANES)), align=8)
        term = builder.fmul(one, factor, flags=_FUSE)
        totals.append(combine(phi, term, flags=_FUSE))
        phi.add_incoming(totals[-1], loop)
    following = builder.add(k, ir.Constant(whole, 1))
    k.add_incoming(following, loop)
    builder.cbranch(builder.icmp_signed("<", following, count), loop, after)
    builder.position_at_end(after)
    return totals


def _make_dot(rows: int, entry: Any = _one_vector) -> Any:
    @intrinsic
    def dot(typingctx, A, a, stride, x, x0, n, y, y0):  # type: ignore[no-untyped-def]
        """y[y0 + 8 r] = sum_k<n A[a + k stride + 8 r] x[x0 + 8 k], for r below `rows`; or with
        x[x0 + k] in all lanes, where rows stand in the lanes.

        All arrays flat float64, all places and strides in doubles, n at least 1.
        """
        signature = types.void(A, a, stride, x, x0, n, y, y0)

        def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
            _, a, stride, _, x0, n, _, y0 = args
            A, x, y = (_data(context, builder, sig.args[i], args[i]) for i in (0, 3, 6))
            first, start = builder.gep(A, [a]), builder.gep(x, [x0])
            zeros = [_ZERO] * rows
            sums = _columns(builder, first, stride, start, n, zeros, builder.fadd, entry)
            for r, value in enumerate(sums):
                place = builder.add(y0, ir.Constant(y0.type, r * LANES))
                builder.store(value, _at(builder, y, place), align=8)
            return context.get_dummy_value()

        return signature, emit

    return dot


dot1, dot2, dot4, dot8 = (_make_dot(rows) for rows in (1, 2, 4, 8))
rows1, rows4, rows8, rows12 = (_make_dot(rows, _one_number) for rows in (1, 4, 8, 12))


def _sum_of_squares(builder: Any, errors: list[Any], weights: list[Any]) -> Any:
    """sum_r weights[r] errors[r]^2 in two chains, as one would wait for itself."""
    chains = [_ZERO, _ZERO]
    for r, error in enumerate(errors):
        weighted = builder.fmul(weights[r], error) if weights else error
        square = builder.fmul(weighted, error, flags=_FUSE)
        chains[r % 2] = builder.fadd(square, chains[r % 2], flags=_FUSE)
    return builder.fadd(*chains)


def _make_compare(rows: int, weighted: bool) -> Any:
    @intrinsic
    def compare(typingctx, A, a, stride, x, x0, n, measured, m0, weights, w0, total):  # type: ignore[no-untyped-def]
        """total[lane] += sum_r weights[w0 + 8 r] (measured[m0 + 8 r] - y[r])^2, where y[r] is
        that of `dot`; without `weighted` the weights are one and not read.
        """
        signature = types.void(A, a, stride, x, x0, n, measured, m0, weights, w0, total)

        def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
            _, a, stride, _, x0, n, _, m0, _, w0, _ = args
            A, x, measured, weights, total = (
                _data(context, builder, sig.args[i], args[i]) for i in (0, 3, 6, 8, 10)
            )

            def row(data, start, r):  # type: ignore[no-untyped-def]
                place = builder.add(start, ir.Constant(start.type, r * LANES))
                return builder.load(_at(builder, data, place), align=8)

            first, start = builder.gep(A, [a]), builder.gep(x, [x0])
            errors = [row(measured, m0, r) for r in range(rows)]
            errors = _columns(builder, first, stride, start, n, errors, builder.fsub)
            factors = [row(weights, w0, r) for r in range(rows)] if weighted else []
            place = _at(builder, total, ir.Constant(m0.type, 0))
            added = _sum_of_squares(builder, errors, factors)
            builder.store(builder.fadd(builder.load(place, align=8), added), place, align=8)
            return context.get_dummy_value()

        return signature, emit

    return compare


compare1, compare2, compare4, compare8 = (_make_compare(rows, False) for rows in (1, 2, 4, 8))
weigh1, weigh2, weigh4, weigh8 = (_make_compare(rows, True) for rows in (1, 2, 4, 8))


def _move(typingctx, y, y0, x, x0):  # type: ignore[no-untyped-def]
    """y[y0 + lane] = x[x0 + lane]."""
    signature = types.void(y, y0, x, x0)

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        source = _at(builder, _data(context, builder, sig.args[2], args[2]), args[3])
        target = _at(builder, _data(context, builder, sig.args[0], args[0]), args[1])
        builder.store(builder.load(source, align=8), target, align=8)
        return context.get_dummy_value()

    return signature, emit


def _of_two(combine: str) -> Any:
    def operation(typingctx, y, y0, x, x0, w, w0):  # type: ignore[no-untyped-def]
        """y = w x, or y -= w x, per lane from the places y0, x0, w0 on."""
        signature = types.void(y, y0, x, x0, w, w0)

        def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
            target, source, factor = (
                _at(builder, _data(context, builder, sig.args[i], args[i]), args[i + 1])
                for i in (0, 2, 4)
            )
            numbers = builder.load(source, align=8), builder.load(factor, align=8)
            product = builder.fmul(*numbers, flags=_FUSE)
            if combine:
                before = builder.load(target, align=8)
                product = getattr(builder, combine)(before, product, flags=_FUSE)
            builder.store(product, target, align=8)
            return context.get_dummy_value()

        return signature, emit

    return operation


def _axpy(typingctx, y, y0, scale, x, x0):  # type: ignore[no-untyped-def]
    """y[y0 + lane] += scale x[x0 + lane]."""
    signature = types.void(y, y0, scale, x, x0)

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        out = _at(builder, _data(context, builder, sig.args[0], args[0]), args[1])
        x = _at(builder, _data(context, builder, sig.args[3], args[3]), args[4])
        factor = _in_all_lanes(builder, args[2])
        term = builder.fmul(builder.load(x, align=8), factor, flags=_FUSE)
        total = builder.fadd(term, builder.load(out, align=8), flags=_FUSE)
        builder.store(total, out, align=8)
        return context.get_dummy_value()

    return signature, emit


# Any: the type checker would ask for the typing context that Numba adds by itself.
axpy: Any = intrinsic(_axpy)
move: Any = intrinsic(_move)
scale: Any = intrinsic(_of_two(""))
subtract: Any = intrinsic(_of_two("fsub"))
