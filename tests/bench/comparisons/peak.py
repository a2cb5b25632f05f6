"""How near the cost comes to what this machine's arithmetic units can do."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

from flexgui.core.lanes.wide import LANES
from flexgui.core.processors import WORKERS
from flexgui.core.simulate.discrete import TAYLOR_RADIUS
from flexgui.core.simulate.piecewise import pieces
from tests.bench.case import MEMBERS, Case, glocal_case, population
from tests.bench.peers import state_space
from tests.bench.row import Row, Size, median_seconds

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


@njit(nogil=True, cache=True)
def multiply_add(count, factor):  # type: ignore[no-untyped-def]
    """count x ACCUMULATORS x LANES multiply-adds on registers."""
    return chain(count, factor)


def operations(count: int) -> int:
    """Multiplications and additions of `multiply_add`."""
    return 2 * count * ACCUMULATORS * LANES


FACTOR = 0.5
"""Keeps the sums finite."""
REPEATS = 5
PRODUCTS = 6
"""Matrix products of the exponential's polynomial; squarings come on top."""


def rows(size: Size) -> list[Row]:
    """GFLOP/s on one thread and on all, and the share that the cost reaches."""
    case = glocal_case(size.seconds)
    count = cost_operations(case)
    members = population()
    found = []
    for workers in (1, WORKERS):
        peak = _peak(workers, size.peak_loops)
        each = _cost_seconds(case, members, workers, size.repeats)
        speed = count / each
        plain = plain_operations(case) / 1e6
        note = (
            f"{count / 1e6:.2f} million operations per cost ({plain:.2f} with a step per sample), "
            f"{speed / 1e9:.0f} GFLOP/s of "
            f"{peak / 1e9:.0f} GFLOP/s with all operands in registers"
        )
        what = f"share of the floating-point peak, {workers} thread(s)"
        found.append(Row(what, each, value=f"{100.0 * speed / peak:.0f} %", note=note))
    return found


def _peak(workers: int, loops: int) -> float:
    """Operations per second with that many threads at once."""
    with ThreadPoolExecutor(workers) as pool:

        def work() -> None:
            list(pool.map(multiply_add, [loops] * workers, [FACTOR] * workers))

        return workers * operations(loops) / median_seconds(work, REPEATS)


def _cost_seconds(case: Case, members: np.ndarray, workers: int, repeats: int) -> float:
    """Time per member of a population's cost on that many threads."""
    usual = case.cost.workers
    case.cost.workers = workers
    try:
        return median_seconds(lambda: case.cost(members), repeats) / MEMBERS
    finally:
        case.cost.workers = usual


def cost_operations(case: Case) -> int:
    """Multiplications and additions of one cost.

    The exponential and its powers, the outputs' rows of a hold; then one step of the state per
    hold, and per sample the outputs, their errors and the squares.
    """
    e, keep = case.experiments[0], case.cost.keep
    A, B, C, _ = state_space(case, e, population(1)[0])
    nx, nr, ny = len(keep), B.shape[1], C.shape[0]
    n = case.model.arm.coordinates
    scale = 2.0 ** np.round(0.5 * np.log2(np.abs(A[n:, :n]).max()))
    size = np.where(keep < n, scale, 1.0)
    norm = np.abs(np.hstack([A[np.ix_(keep, keep)] * size[:, None] / size, B[keep]])).sum(axis=1)
    halvings = np.log2(float(norm.max()) * e.task.sample_time / TAYLOR_RADIUS)
    found = pieces([e.task.references for e in case.experiments], len(e.task.time), nx, nr, ny)
    longest, columns = int(found.lengths.max()), nx + nr
    powers = int(np.log2(longest)) + sum(int(k).bit_count() - 1 for k in found.lengths)
    products = PRODUCTS + max(int(np.ceil(halvings)), 0) + powers
    build = products * columns**3 + (longest - 1) * ny * columns**2
    march = found.count * nx * columns + len(e.task.time) * ny * (columns + 1)
    return 2 * LANES * (build + march)


def plain_operations(case: Case) -> int:
    """What one step per sample would take, without the exponential."""
    e, nx = case.experiments[0], len(case.cost.keep)
    nr, ny = e.task.references.shape[1], e.measured.shape[1]
    return 2 * LANES * len(e.task.time) * ((nx + ny) * (nx + nr) + ny)
