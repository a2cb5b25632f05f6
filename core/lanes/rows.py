"""Products of wide matrices in rows at a time, whose sums stay in registers.

Numba does not turn loops over the rows into independent sums, because it cannot know that the
arrays do not overlap. These instructions say it outright.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir

from ..compiler import intrinsic, njit, types
from ..lanes.functions import INLINE
from ..lanes.wide import VECTOR, row_pointer, spread_in, wide

_ZERO = ir.Constant(VECTOR, None)
_FUSE = ("contract",)


def _make_dot(rows: int) -> Any:
    @intrinsic
    def dot(typingctx, A, a, column, x, x0, n):  # type: ignore[no-untyped-def]
        """sum_k<n A[a + k column + r] x[x0 + k] for r below `rows`, n at least 1: of a matrix that
        stands column by column. Where x holds doubles, each counts in all lanes."""

        def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
            A, a, column, x, x0, n = args
            first = row_pointer(context, builder, sig.args[0], A, a)
            before, loop = builder.block, builder.append_basic_block("dot")
            after = builder.append_basic_block("dotted")
            builder.branch(loop)
            builder.position_at_end(loop)
            k, sums = builder.phi(n.type), [builder.phi(VECTOR) for _ in range(rows)]
            place = row_pointer(context, builder, sig.args[3], x, builder.add(x0, k))
            factor = builder.load(place, align=8)
            if sig.args[3].ndim == 1:
                factor = spread_in(builder, factor)
            start, totals = builder.gep(first, [builder.mul(k, column)]), []
            for r, phi in enumerate(sums):
                entry = builder.load(builder.gep(start, [ir.Constant(n.type, r)]), align=8)
                term = builder.fmul(entry, factor, flags=_FUSE)
                totals.append(builder.fadd(phi, term, flags=_FUSE))
                phi.add_incoming(_ZERO, before)
                phi.add_incoming(totals[-1], loop)
            following = builder.add(k, ir.Constant(n.type, 1))
            k.add_incoming(ir.Constant(n.type, 0), before)
            k.add_incoming(following, loop)
            builder.cbranch(builder.icmp_signed("<", following, n), loop, after)
            builder.position_at_end(after)
            return context.make_tuple(builder, sig.return_type, totals)

        places = (types.intp, types.intp)
        return types.UniTuple(wide, rows)(A, *places, x, *places), emit

    return dot


dot1, dot2, dot4, dot8, dot12 = (_make_dot(rows) for rows in (1, 2, 4, 8, 12))


def _put_rows(typingctx, y, at, values):  # type: ignore[no-untyped-def]
    """y[at + r] = values[r]."""

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        first = row_pointer(context, builder, sig.args[0], args[0], args[1])
        for r in range(sig.args[2].count):
            place = builder.gep(first, [ir.Constant(args[1].type, r)])
            builder.store(builder.extract_value(args[2], r), place, align=8)
        return context.get_dummy_value()

    return types.void(y, types.intp, values), emit


def _squares(typingctx, values, measured, weights, at):  # type: ignore[no-untyped-def]
    """sum_r weights[at + r] (measured[at + r] - values[r])^2; weights None are one."""

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        def row(which: int, r: int) -> Any:
            start = row_pointer(context, builder, sig.args[which], args[which], args[3])
            return builder.load(builder.gep(start, [ir.Constant(args[3].type, r)]), align=8)

        chains = [_ZERO, _ZERO]  # two, as one would wait for itself
        for r in range(sig.args[0].count):
            error = builder.fsub(row(1, r), builder.extract_value(args[0], r))
            factor = error if weights is types.none else builder.fmul(row(2, r), error)
            square = builder.fmul(factor, error, flags=_FUSE)
            chains[r % 2] = builder.fadd(square, chains[r % 2], flags=_FUSE)
        return builder.fadd(*chains)

    return wide(values, measured, weights, types.intp), emit


# Any: the type checker would ask for the typing context that Numba adds by itself.
put_rows: Any = intrinsic(_put_rows)
squares: Any = intrinsic(_squares)


@njit(**INLINE)
def apply(A, a, column, rows, x, x0, n, y, y0):  # type: ignore[no-untyped-def]
    """y = A x, for `rows` rows of A from a on, whose columns stand `column` apart; x (n,) and y
    from x0 and y0 on."""
    r = 0
    while r + 8 <= rows:
        put_rows(y, y0 + r, dot8(A, a + r, column, x, x0, n))
        r += 8
    if r + 4 <= rows:
        put_rows(y, y0 + r, dot4(A, a + r, column, x, x0, n))
        r += 4
    if r + 2 <= rows:
        put_rows(y, y0 + r, dot2(A, a + r, column, x, x0, n))
        r += 2
    if r < rows:
        put_rows(y, y0 + r, dot1(A, a + r, column, x, x0, n))


@njit(**INLINE)
def compare(A, column, rows, x, x0, n, measured, weights, at):  # type: ignore[no-untyped-def]
    """The sum of squares of measured[at:] - A x over the first `rows` rows of A, each times its
    weight, where there are any."""
    total, r = 0.0, 0
    while r + 8 <= rows:
        total += squares(dot8(A, r, column, x, x0, n), measured, weights, at + r)
        r += 8
    if r + 4 <= rows:
        total += squares(dot4(A, r, column, x, x0, n), measured, weights, at + r)
        r += 4
    if r + 2 <= rows:
        total += squares(dot2(A, r, column, x, x0, n), measured, weights, at + r)
        r += 2
    if r < rows:
        total += squares(dot1(A, r, column, x, x0, n), measured, weights, at + r)
    return total
