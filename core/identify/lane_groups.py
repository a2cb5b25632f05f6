"""Recordings and population members side by side in the lanes of the vector unit.

Seven recordings take seven lanes of eight, one member at a time; or one recording takes all
lanes, with eight members at a time. A pass is one run of LANES systems.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from core.identify.prepared import Prepared
from core.simulate.holds import Pieces, changes, cut, pieces
from core.simulate.linear import interleave
from core.simulate.postures import Nodes, interpolation, midpoints
from core.simulate.vector import LANES

T = TypeVar("T")


@dataclass(frozen=True)
class Plan:
    """How one recording's posture is followed."""

    joints: tuple[int, ...] = ()
    """Coordinates on whose recorded positions the matrices depend; none at a working point."""
    degree: int = 0
    """Of the polynomial that interpolates the matrices over them."""
    longest: int = 1
    """Samples over which the posture may count as one; a working point sets no limit."""

    @property
    def moves(self) -> bool:
        return self.degree > 0


@dataclass(frozen=True)
class Size:
    """Of the systems: states that matter, held references, outputs; `held` as the drive has it."""

    states: int
    references: int
    outputs: int
    held: bool


@dataclass(frozen=True)
class LaneGroup:
    """Some recordings, repeated so that they fill the lanes, as compiled code takes them."""

    members: tuple[int, ...]
    """Which of the recordings."""
    copies: int
    samples: int
    """Of the longest recording."""
    nodes: np.ndarray
    """(d, LANES, n) node postures"""
    shares: np.ndarray
    """(pieces, d, LANES) flat"""
    h: np.ndarray
    """(LANES,) s"""
    references: np.ndarray
    """(samples + 1, nr, LANES) flat"""
    pieces: Pieces

    def lanes(self, values: Sequence[T]) -> list[T]:
        """One value per lane from one per recording, copies and fillers included."""
        filled = list(values) * self.copies
        return filled + [values[0]] * (LANES - len(filled))

    def passes(self, size: int) -> int:
        """That `size` population members need."""
        return -(-size // self.copies)

    def packing(self, size: int) -> np.ndarray:
        """(passes, LANES): which of `size` population members each lane has; the last pass
        repeats the last member."""
        passes = self.passes(size)
        order = np.minimum(np.arange(passes * self.copies), size - 1).reshape(passes, self.copies)
        copy = np.arange(LANES) // len(self.members)
        return np.asarray(order[:, np.where(copy < self.copies, copy, 0)])

    def work(self, size: int) -> float:
        """Of that many members, in steps of the state."""
        steps = len(self.pieces.starts) * len(self.nodes)
        return float(self.passes(size) * (steps + self.samples))


def lane_group(
    members: Sequence[int], experiments: Sequence[Prepared], plans: Sequence[Plan], size: Size
) -> LaneGroup:
    """Up to LANES of the experiments, each followed by its plan."""
    chosen, planned = [experiments[i] for i in members], [plans[i] for i in members]
    samples = max(len(e.task.time) for e in chosen)
    found = _pieces(chosen, planned, samples, size)
    nodes = [_nodes(e, plan, found) for e, plan in zip(chosen, planned, strict=True)]
    copies = max(LANES // len(chosen), 1)
    empty = np.zeros(0)
    draft = LaneGroup(tuple(members), copies, samples, empty, empty, empty, empty, found)
    postures, shares = _padded(nodes)
    return LaneGroup(
        tuple(members),
        copies,
        samples,
        np.ascontiguousarray(np.stack(draft.lanes(postures), axis=1)),
        np.ascontiguousarray(np.stack(draft.lanes(shares), axis=2)).ravel(),
        np.array(draft.lanes([e.recording.sample_time for e in chosen])),
        interleave(draft.lanes([e.task.references for e in chosen]), samples + 1).ravel(),
        found,
    )


def _pieces(
    chosen: Sequence[Prepared], planned: Sequence[Plan], samples: int, size: Size
) -> Pieces:
    if not size.held:
        return cut(np.zeros(0, dtype=np.int64), samples, 1)
    references = [e.task.references for e in chosen]
    moving = [plan.longest for plan in planned if plan.moves]
    if moving:
        return cut(changes(references, samples), samples, min(moving))
    return pieces(references, samples, size.states, size.references, size.outputs)


def _nodes(e: Prepared, plan: Plan, found: Pieces) -> Nodes:
    """The nodes of one recording, with shares per piece."""
    schedule = e.task.schedule
    if not plan.moves:
        center = 0.5 * (schedule.min(axis=0) + schedule.max(axis=0))
        return Nodes(center[None], np.ones((len(found.starts), 1)))
    missing = int(found.starts[-1] + found.counts[-1]) - len(schedule)
    points = midpoints(schedule)
    points = np.vstack([points, np.repeat(points[-1:], missing, axis=0)])
    means = np.add.reduceat(points, found.starts, axis=0) / found.counts[:, None]
    return interpolation(means, list(plan.joints), plan.degree)


def _padded(nodes: Sequence[Nodes]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Postures (d, n) and shares (pieces, d) with the same d for all: more nodes without share."""
    d = max(len(each.postures) for each in nodes)
    postures, shares = [], []
    for each in nodes:
        more = d - len(each.postures)
        postures.append(np.vstack([each.postures, np.repeat(each.postures[-1:], more, axis=0)]))
        shares.append(np.hstack([each.shares, np.zeros((len(each.shares), more))]))
    return postures, shares
