"""Runs of the compiled linear model for groups of recordings, on all cores."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np

from core.identify import predictor
from core.identify.lane_groups import LaneGroup
from core.identify.lane_numbers import Lanes
from core.model import Model
from core.simulate.pieces import STORE, piecewise
from core.simulate.vector import LANES

NOTHING = np.zeros(0)
_NO_OUTPUTS = np.zeros((1, 0))


@cache
def _pool() -> ThreadPoolExecutor:
    """Made once: starting threads takes longer than a small cost."""
    return ThreadPoolExecutor(predictor.WORKERS, thread_name_prefix="linear")


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pool.cache_clear)  # its threads stay with the parent


def share(jobs: Sequence[Callable[[], None]]) -> None:
    """Does the jobs on all cores; the caller's thread takes its part.

    Compiled code holds no lock. An exception of a job is raised here.
    """
    waiting = iter(jobs)

    def work() -> None:
        for job in waiting:
            job()

    others = min(predictor.WORKERS, len(jobs)) - 1
    helpers = [_pool().submit(work) for _ in range(others)]
    work()
    for helper in helpers:
        helper.result()


def stored(
    model: Model, group: LaneGroup, numbers: Lanes, keep: np.ndarray, held: bool, s: int
) -> np.ndarray:
    """(samples, k, LANES): the linear outputs of one pass."""
    k = numbers.C.shape[2]
    out, one = np.empty((1, group.samples * k * LANES)), slice(s, s + 1)
    piecewise(
        model.compiled.dynamics, model.compiled.linear, numbers.p[one],
        tuple(law[one] for law in numbers.laws), numbers.C[one], numbers.D[one], group.nodes,
        group.h, keep, held, numbers.x0[one], group.references, group.pieces.lengths,
        group.pieces.starts, group.pieces.counts, group.pieces.which, group.shares, STORE,
        NOTHING, NOTHING, np.empty((1, LANES)), out, 0, 1,
    )  # fmt: skip
    return out.reshape(group.samples, k, LANES)


def compared(
    model: Model, group: LaneGroup, numbers: Lanes, keep: np.ndarray, held: bool, mode: int,
    measured: np.ndarray, weights: np.ndarray, workers: int,
) -> np.ndarray:  # fmt: skip
    """(passes, LANES): the squared errors of all passes; measured and weights (T, k, LANES) flat.

    `mode` is COMPARE or WEIGH of core.simulate.pieces.
    """
    costs = np.empty((len(numbers.p), LANES))
    ends = [len(costs) * i // workers for i in range(workers + 1)]

    def part(first: int, last: int) -> Callable[[], None]:
        return lambda: piecewise(
            model.compiled.dynamics, model.compiled.linear, numbers.p, numbers.laws, numbers.C,
            numbers.D, group.nodes, group.h, keep, held, numbers.x0, group.references,
            group.pieces.lengths, group.pieces.starts, group.pieces.counts, group.pieces.which,
            group.shares, mode, measured, weights, costs, _NO_OUTPUTS, first, last,
        )  # fmt: skip

    pairs = zip(ends[:-1], ends[1:], strict=True)
    share([part(a, b) for a, b in pairs if b > a])
    return costs
