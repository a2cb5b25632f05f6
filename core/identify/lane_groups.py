"""Recordings and population members in the lanes of the vector unit.

At working points the lanes hold systems: seven recordings take seven of eight lanes, one member at
a time; or one recording takes all lanes, with eight members at a time. A recording with varying
posture is a group of its own. A pass is one run of a group.
"""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from typing import TypeVar

import numpy as np

from ..identify.prepared_recording import Prepared
from ..lanes.wide import LANES
from ..model import Model
from ..processors import WORKERS, workers
from ..progress import check_stopped, current_progress, use_progress
from ..simulate.along_motion import followed
from ..simulate.linear import interleave
from ..simulate.piecewise import STORE, Pieces, cut, pieces, piecewise
from ..simulate.posture_interpolation import Nodes

T = TypeVar("T")
_NOTHING = np.zeros(0)

HANDLING = 6000
"""Samples and steps in the time that laying out a group's numbers takes: 35 us."""


@dataclass(frozen=True)
class Lanes:
    """A group's numbers: p (passes, LANES, np), laws, C and D likewise, x0 (passes, LANES, N)."""

    p: np.ndarray
    laws: tuple[np.ndarray, ...]
    C: np.ndarray
    D: np.ndarray
    x0: np.ndarray


@dataclass(frozen=True)
class System:
    """What all recordings share."""

    model: Model
    keep: np.ndarray
    """Indices of the states that matter."""
    held_references: bool
    """Whether references are held between samples; else they are linear."""


@cache
def _packing(recordings: int, copies: int, size: int) -> np.ndarray:
    """See Group.packing."""
    passes = -(-size // copies)
    order = np.minimum(np.arange(passes * copies), size - 1).reshape(passes, copies)
    copy = np.arange(LANES) // recordings
    return np.asarray(order[:, np.where(copy < copies, copy, 0)])


@dataclass(frozen=True)
class Group(ABC):
    """Some recordings, repeated so that they fill the lanes."""

    members: tuple[int, ...]
    """Which of the recordings."""
    samples: int
    """Of the longest recording."""

    @property
    def copies(self) -> int:
        """Population members per pass."""
        return max(LANES // len(self.members), 1)

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
        return _packing(len(self.members), self.copies, size)

    @abstractmethod
    def outputs(self, system: System, numbers: Lanes, s: int, count: int) -> np.ndarray:
        """(samples, k, lanes): the linear outputs of pass s, of which `count` members differ."""


@dataclass(frozen=True)
class PointGroup(Group):
    """Up to LANES recordings at working points."""

    postures: np.ndarray
    """(LANES, n)"""
    h: np.ndarray
    """(LANES,) s"""
    references: np.ndarray
    """(samples + 1, nr, LANES) flat"""
    pieces: Pieces

    def work(self, size: int) -> int:
        """Of that many members, in samples and steps."""
        return HANDLING + self.passes(size) * (self.samples + self.pieces.count)

    def outputs(self, system: System, numbers: Lanes, s: int, count: int) -> np.ndarray:
        k, only = numbers.C.shape[2], slice(s, s + 1)
        out = np.empty((1, self.samples * k * LANES))
        part = Lanes(numbers.p[only], tuple(law[only] for law in numbers.laws), numbers.C[only],
                     numbers.D[only], numbers.x0[only])  # fmt: skip
        self.run(system, part, STORE, _NOTHING, _NOTHING, np.empty((1, LANES)), out, (0, 1))
        return out.reshape(self.samples, k, LANES)

    def run(  # noqa: PLR0913 (as compiled code takes it)
        self, system: System, numbers: Lanes, mode: int, measured: np.ndarray,
        weights: np.ndarray, costs: np.ndarray, out: np.ndarray, passes: tuple[int, int],
    ) -> None:  # fmt: skip
        """The passes from the first to before the second, see core.simulate.piecewise.piecewise;
        fills `costs` (passes, LANES) from `measured` and `weights` (T, k, LANES) flat, or `out`
        (passes, T k LANES), as `mode` says."""
        piecewise(
            system.model.compiled.addresses, numbers.p, numbers.laws, numbers.C, numbers.D,
            self.postures, self.h, system.keep, system.held_references, numbers.x0, self.references,
            self.pieces.lengths, self.pieces.table, mode, measured, weights, costs, out, *passes,
        )  # fmt: skip


@dataclass(frozen=True)
class FollowedGroup(Group):
    """One recording whose posture is followed."""

    nodes: np.ndarray
    """(d, n)"""
    shares: np.ndarray
    """(samples, d) flat"""
    h: float
    references: np.ndarray
    """(samples + 1, nr) flat"""

    def outputs(self, system: System, numbers: Lanes, s: int, count: int) -> np.ndarray:
        out = np.empty((self.samples, numbers.C.shape[2], count))
        followed(
            system.model.compiled.addresses, numbers.p[s], tuple(law[s] for law in numbers.laws),
            numbers.C[s], numbers.D[s], self.nodes, self.h, system.keep, system.held_references,
            numbers.x0[s], self.references, self.shares, out, 0, count,
        )  # fmt: skip
        return out


def point_group(
    members: Sequence[int], experiments: Sequence[Prepared], system: System, outputs: int
) -> PointGroup:
    """Up to LANES of the experiments, each at its working point, with that many outputs."""
    chosen = [experiments[i] for i in members]
    samples = max(len(e.task.time) for e in chosen)
    references = [e.task.references for e in chosen]
    if system.held_references:
        inputs = references[0].shape[1]
        parts = pieces(references, samples, len(system.keep), inputs, outputs)
    else:
        parts = cut(np.zeros(0, dtype=np.int64), samples, 1)
    empty = np.zeros(0)
    draft = PointGroup(tuple(members), samples, empty, empty, empty, parts)
    return PointGroup(
        tuple(members), samples, np.array(draft.lanes([e.task.schedule[0] for e in chosen])),
        np.array(draft.lanes([e.recording.sample_time for e in chosen])),
        interleave(draft.lanes(references), samples + 1).ravel(), parts,
    )  # fmt: skip


def followed_group(i: int, experiments: Sequence[Prepared], nodes: Nodes) -> FollowedGroup:
    """One experiment along its recorded motion."""
    e = experiments[i]
    references = np.vstack([e.task.references, e.task.references[-1:]])
    return FollowedGroup(
        (i,), len(e.task.time), np.ascontiguousarray(nodes.postures),
        np.ascontiguousarray(nodes.shares).ravel(), e.recording.sample_time,
        np.ascontiguousarray(references, dtype=float).ravel(),
    )  # fmt: skip


@cache
def _pool() -> ThreadPoolExecutor:
    """Made once: starting threads takes longer than a small cost."""
    return ThreadPoolExecutor(WORKERS, thread_name_prefix="linear")


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pool.cache_clear)  # its threads stay with the parent


def share(jobs: Sequence[Callable[[], None]]) -> None:
    """Do the jobs on this thread and others. Compiled code holds no lock. The work can be stopped
    between jobs; a job's exception is raised here."""
    waiting, progress = iter(jobs), current_progress()

    def work() -> None:
        with use_progress(progress):
            for job in waiting:
                check_stopped()
                job()

    others = min(workers(), len(jobs)) - 1
    helpers = [_pool().submit(work) for _ in range(others)]
    work()
    for helper in helpers:
        helper.result()
