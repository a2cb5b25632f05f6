"""Compiled response of the LPV descriptor model, piece by piece instead of sample by sample.

At a working point, over a piece with held references, the state needs one step and the outputs
are one product,

    x_next = F_l [r; x],    [y_0; y_1; ...] = [C D; (C D) S; (C D) S^2; ...] [r; x],

with the one-sample step S of [r; x] and F_l the lower rows of S^l. Numbers are wide: each is one of
LANES independent systems, see core.simulate.discrete.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arm.signatures import (
    OPTIONS,
    addresses,
    cube,
    dynamics_of,
    kernel,
    linear_of,
    matrix,
    vector,
)
from ..compiler import int64, njit, types
from ..lanes.algebra import copy, write
from ..lanes.rows import apply, compare
from ..lanes.wide import LANES, get, put
from ..simulate.discrete import (
    aligned,
    discretised,
    place,
    product,
    start,
    work_arrays,
    write_outputs,
    write_step,
)

POPULATION = types.Tuple((types.float64[:, :, :, ::1],) * 8)
"""R, P, V, S, Fs, Fq, Fv, Fr of core.drives.law.DriveLaw; passes, then lanes, come first."""

COMPARE, WEIGH, STORE = range(3)
"""What happens to outputs: squared errors, weighted squared errors, or they are written."""

LONGEST_PIECE = 32
"""Samples of a piece at most: beyond it the outputs' rows leave the first-level cache."""


@dataclass(frozen=True)
class Pieces:
    """Consecutive pieces that cover all samples."""

    table: np.ndarray
    """(3, B): first samples, numbers of samples, and the numbers' places among `lengths`"""
    lengths: np.ndarray
    """The distinct numbers, ascending."""

    @property
    def count(self) -> int:
        """B"""
        return int(self.table.shape[1])


def changes(references: Sequence[np.ndarray], samples: int) -> np.ndarray:
    """Samples (E,) after the first at which some experiment's references (N_i, nr) change."""
    samples_of_change: set[int] = set()
    for signal in references:
        samples_of_change.update(
            (np.flatnonzero(np.any(signal[1:] != signal[:-1], axis=1)) + 1).tolist()
        )
    return np.array(sorted(k for k in samples_of_change if k < samples), dtype=np.int64)


def cut(edges: np.ndarray, samples: int, longest: int) -> Pieces:
    """The stretches between the edges (E,), each in pieces of `longest` samples and a rest."""
    bounds = np.concatenate([[0], edges, [samples]])
    starts = np.concatenate(
        [np.arange(a, b, longest) for a, b in zip(bounds[:-1], bounds[1:], strict=True)]
    ).astype(np.int64)
    counts = np.diff(np.append(starts, samples)).astype(np.int64)
    lengths, which = np.unique(counts, return_inverse=True)
    return Pieces(np.stack([starts, counts, which.ravel()]).astype(np.int64), lengths)


def pieces(
    references: Sequence[np.ndarray], samples: int, states: int, inputs: int, outputs: int
) -> Pieces:
    """The pieces of least work for a system with that many states, held inputs and outputs."""
    edges = changes(references, samples)
    columns = states + inputs

    def work(length: int) -> int:
        """Multiply-adds that depend on the longest piece."""
        candidate = cut(edges, samples, length)
        powers = len(candidate.lengths) + int(np.ceil(np.log2(length + 1)))
        per_build = powers * columns**3 + length * outputs * columns**2
        return per_build + candidate.count * states * columns

    runs = np.diff(np.concatenate([[0], edges, [samples]]))
    lengths = sorted({min(int(run), LONGEST_PIECE) for run in np.unique(runs)} | {1})
    return cut(edges, samples, min(lengths, key=work))


@njit(**OPTIONS)
def raise_steps(work, m, nx, ny, lengths, longest, F, stride, Y):  # type: ignore[no-untyped-def]
    """Powers and output rows by doubling: work[0] holds S, Y its first ny rows.

    The step over lengths[i] samples goes to F from i stride on: the lower rows of that power of S.
    Y gets longest ny rows.
    """
    na = m + nx
    column = longest * ny
    P, Q = 0, 1
    started = np.zeros(lengths.size, dtype=np.bool_)
    done, bit = 1, 1
    while True:
        for i in range(lengths.size):
            if lengths[i] & bit:
                own = 3 + i
                if started[i]:
                    product(work[2], work[own], work[P], na)
                    copy(work[own], work[2])
                else:
                    started[i] = True
                    copy(work[own], work[P])
        if done < longest:
            more = min(done, longest - done)
            for j in range(na):
                at = j * column + done * ny
                apply(Y, 0, column, more * ny, work[P], j * na, na, Y, at)
            done += more
        bit *= 2
        if bit > longest:
            break
        product(work[Q], work[P], work[P], na)
        P, Q = Q, P
    for i in range(lengths.size):
        for j in range(na):
            write(F, i * stride + j * nx, work[3 + i][j * na + m : (j + 1) * na])


@njit(**OPTIONS)
def build(  # type: ignore[no-untyped-def]
    dynamics, linear, p, laws, C, D, postures, h, keep, hold, lengths, longest, F, Y, steps, aug,
    work, space,
):  # fmt: skip
    """Fills F (lengths, na columns of nx) and Y; returns the unit of q in the states."""
    n, nr, ns = postures.shape[1], laws[0].shape[2], laws[3].shape[2]
    rows, nx = longest * C.shape[1], keep.size
    m = nr if hold else 2 * nr
    na = m + nx
    for lane in range(LANES):
        place(dynamics, linear, p[lane], postures[lane], laws, lane, lane, space)
    E, unit = discretised(space, n, nr, 2 * n + ns + nr, keep, h, 0.0, aug, na, work)
    write_step(E, nx, m, nr, hold, steps[0], na, m)
    for i in range(m):
        for j in range(na):
            put(steps[0], j * na + i, 1.0 if i == j else 0.0)
    for lane in range(LANES):
        write_outputs(C[lane], D[lane], keep, n, m, unit, Y[:, lane], rows, 0)
    raise_steps(steps, m, nx, C.shape[1], lengths, longest, F, na * nx, Y)
    return unit


@njit(**OPTIONS)
def march(  # type: ignore[no-untyped-def]
    F, Y, nx, ny, m, nr, longest, z, refs, pieces, mode, measured, weights, total,
    out,
):  # fmt: skip
    """Goes through the pieces; z: two buffers [r; x] that take turns, the first holds the start.
    total (1,) gets the sum of squares."""
    na, column = m + nx, longest * ny
    squares = get(total, 0)
    for b in range(pieces.shape[1]):
        t, old = pieces[0, b], (b & 1) * na
        new = na - old
        for i in range(m):
            put(z, old + i, get(refs, t * nr + i))
        apply(F, pieces[2, b] * na * nx, nx, nx, z, old, na, z, new + m)
        rows, at = pieces[1, b] * ny, t * ny
        if mode == COMPARE:
            squares += compare(Y, column, rows, z, old, na, measured, None, at)
        elif mode == WEIGH:
            squares += compare(Y, column, rows, z, old, na, measured, weights, at)
        else:
            apply(Y, 0, column, rows, z, old, na, out, at)
    put(total, 0, squares)


@njit(**OPTIONS)
def lanes_of(x):  # type: ignore[no-untyped-def]
    """A flat array as wide numbers (entries, LANES)."""
    return x.reshape((x.size // LANES, LANES))


@kernel(
    types.void(
        addresses, cube, POPULATION, types.float64[:, :, :, ::1],
        types.float64[:, :, :, ::1], matrix, vector, types.int64[::1], types.boolean, cube, vector,
        types.int64[::1], types.int64[:, ::1], int64, vector, vector, matrix, matrix, int64, int64,
    ),
)  # fmt: skip
def piecewise(  # type: ignore[no-untyped-def]
    arm, p, laws, C, D, postures, h, keep, hold, x0, refs, lengths, pieces, mode,
    measured, weights, costs, out, first, last,
):  # fmt: skip
    """The passes first..last-1 of LANES systems each; the only entry from Python.

    arm (3,): the addresses of its functions.
    p (passes, LANES, np), laws, C (passes, LANES, ny, N), D (passes, LANES, ny, nr) and x0
    (passes, LANES, N) belong to the passes, the rest to all of them: postures (LANES, n), h
    (LANES,) in s, keep (nx,) the states that matter, refs (T + 1, nr, LANES) flat; pieces
    (3, B), their first samples, numbers of samples and places among the distinct `lengths`.
    Writes costs (passes, LANES) from measured and weights (T, ny, LANES) flat, or
    out (passes, T ny LANES), as `mode` says.
    """
    R, P, V, S, Fs, Fq, Fv, Fr = laws
    dynamics, linear = dynamics_of(arm), linear_of(arm)
    n, nr = postures.shape[1], R.shape[3]
    ny, nx = C.shape[2], keep.size
    m = nr if hold else 2 * nr
    na, longest = m + nx, lengths.max()
    refs, measured, weights = lanes_of(refs), lanes_of(measured), lanes_of(weights)
    h = h.reshape((1, LANES))
    aug, work = aligned(na * na), aligned(5 * na * na).reshape((5, na * na, LANES))
    count = 3 + lengths.size
    steps = aligned(count * na * na).reshape((count, na * na, LANES))
    F, Y = aligned(lengths.size * nx * na), aligned(longest * ny * na)
    z, total = aligned(2 * na), aligned(1)
    space = work_arrays(n, S.shape[3], nr)
    for s in range(first, last):
        law = (R[s], P[s], V[s], S[s], Fs[s], Fq[s], Fv[s], Fr[s])
        unit = build(
            dynamics, linear, p[s], law, C[s], D[s], postures, h, keep, hold, lengths, longest,
            F, Y, steps, aug, work, space,
        )  # fmt: skip
        for lane in range(LANES):
            start(x0[s, lane], keep, n, unit, z[m:, lane])
        put(total, 0, 0.0)
        march(
            F, Y, nx, ny, m, nr, longest, z, refs, pieces, mode, measured,
            weights, total, lanes_of(out[s] if mode == STORE else out[0]),
        )  # fmt: skip
        for lane in range(LANES):
            costs[s, lane] = total[0, lane]
