"""The most multiply-adds per second that compiled code reaches on this machine."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

from core.simulate.vector import LANES

ACCUMULATORS = 8
"""Independent sums: enough to hide the latency of a multiply-add, few enough to stay in
registers."""

_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_FUSE = ("contract",)


def _spread(builder: Any, value: Any) -> Any:
    """One number in all lanes."""
    whole = ir.IntType(32)
    empty = ir.Constant(_VECTOR, ir.Undefined)
    single = builder.insert_element(empty, value, ir.Constant(whole, 0))
    mask = ir.Constant(ir.VectorType(whole, LANES), [0] * LANES)
    return builder.shuffle_vector(single, empty, mask)


def _repeat(builder: Any, count: Any, factor: Any) -> list[Any]:
    """Emits a loop of sums[i] = sums[i] factor + factor, `count` times."""
    before, loop = builder.block, builder.append_basic_block("loop")
    after = builder.append_basic_block("after")
    builder.branch(loop)
    builder.position_at_end(loop)
    k = builder.phi(count.type)
    k.add_incoming(ir.Constant(count.type, 0), before)
    sums = [builder.phi(_VECTOR) for _ in range(ACCUMULATORS)]
    totals = []
    for i, value in enumerate(sums):
        value.add_incoming(ir.Constant(_VECTOR, [float(i)] * LANES), before)
        product = builder.fmul(value, factor, flags=_FUSE)
        totals.append(builder.fadd(product, factor, flags=_FUSE))
        value.add_incoming(totals[-1], loop)
    following = builder.add(k, ir.Constant(count.type, 1))
    k.add_incoming(following, loop)
    builder.cbranch(builder.icmp_signed("<", following, count), loop, after)
    builder.position_at_end(after)
    return totals


def _chain(typingctx, count, factor):  # type: ignore[no-untyped-def]
    """The sum of all lanes of all accumulators, so that none of the work can be left out."""

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        totals = _repeat(builder, args[0], _spread(builder, args[1]))
        total = totals[0]
        for value in totals[1:]:
            total = builder.fadd(total, value)
        lanes = [ir.Constant(ir.IntType(32), lane) for lane in range(LANES)]
        result = builder.extract_element(total, lanes[0])
        for lane in lanes[1:]:
            result = builder.fadd(result, builder.extract_element(total, lane))
        return result

    return types.float64(count, factor), emit


chain: Any = intrinsic(_chain)


@njit(types.float64(types.int64, types.float64), nogil=True, cache=True)
def multiply_add(count, factor):  # type: ignore[no-untyped-def]
    """count x ACCUMULATORS x LANES multiply-adds on registers."""
    return chain(count, factor)


def operations(count: int) -> int:
    """Multiplications and additions of `multiply_add`."""
    return 2 * count * ACCUMULATORS * LANES
