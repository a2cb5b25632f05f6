"""The cost of a whole population at once, for linear models.

The cost (13) of every member over every recording is compiled code that holds no lock. At working
points, unprocessed outputs are compared as they are computed and never stored; all others go
through LinearOutputs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from ..identify.lane_groups import Lanes, PointGroup, share
from ..identify.linear_outputs import LinearOutputs
from ..identify.prepared_recording import Prepared
from ..identify.unknowns import GAIN, OFFSET, Unknowns
from ..lanes.wide import LANES
from ..processors import workers
from ..simulate.linear import interleave
from ..simulate.piecewise import COMPARE, WEIGH

_NO_OUTPUTS = np.zeros((1, 0))


@dataclass(frozen=True)
class _Target:
    """What a group's outputs are compared with, per lane."""

    mode: int
    measured: np.ndarray
    """(samples, k, LANES) flat; times the channel's weight where all samples count"""
    weights: np.ndarray
    """likewise, of the squares; empty where all samples count"""
    scale: np.ndarray | None
    """(LANES, k, 1) of the outputs; None where all are one"""


class PopulationCost:
    """costs(vectors (S, P)) -> (S,), the weighted squared error over all recordings."""

    def __init__(
        self, experiments: Sequence[Prepared], weights: Sequence[np.ndarray], unknowns: Unknowns,
        fixed: Mapping[str, float],
    ) -> None:  # fmt: skip
        self.experiments, self.weights = experiments, weights
        self.outputs = LinearOutputs(experiments, unknowns, fixed)
        labels = [item.parameter.name for item in unknowns.items]
        self._gains = np.array([name.startswith(GAIN) for name in labels], dtype=bool)
        self._offsets = np.array([name.startswith(OFFSET) for name in labels], dtype=bool)
        self._touching = bool(self._gains.any() or self._offsets.any())
        self._fixed_touch = any(
            (k.startswith(GAIN) and v != 1.0) or (k.startswith(OFFSET) and v != 0.0)
            for k, v in fixed.items()
        )
        self._targets: dict[tuple[int, ...], _Target] = {}

    def __call__(self, vectors: np.ndarray) -> np.ndarray:
        vectors = np.ascontiguousarray(np.atleast_2d(vectors), dtype=float)
        untouched = self._untouched(vectors)
        sums_by_recording = np.zeros((len(self.experiments), len(vectors)))
        add = partial(self._add, sums_by_recording)
        jobs: list[Callable[[], None]] = []
        sums: list[Callable[[], None]] = []
        for group in self.outputs.groups(len(vectors)):
            numbers = self.outputs.numbers.lanes(group, vectors)
            if untouched and isinstance(group, PointGroup) and self.outputs.plain[group.members[0]]:
                costs = np.empty((len(numbers.p), LANES))
                jobs += self._comparisons(group, numbers, costs)
                sums.append(partial(_unpack, group, costs, sums_by_recording))
            else:
                jobs += self.outputs.jobs(group, numbers, vectors, add)
        share([*jobs, *self.outputs.simulations(vectors, add)])
        for each in sums:
            each()
        return np.asarray(sums_by_recording.sum(axis=0))

    @property
    def is_cheap(self) -> bool:
        """Whether members differ in the arm's numbers alone, which are computed for all at once:
        where drives, outputs or first states differ as well, this takes longer than to simulate."""
        return not (self.outputs.numbers.rows_vary or self.outputs.numbers.starts_vary)

    def _untouched(self, vectors: np.ndarray) -> bool:
        """Whether no gain and no offset changes an output."""
        if not (self._touching or self._fixed_touch):
            return True
        gains, offsets = vectors[:, self._gains], vectors[:, self._offsets]
        return not self._fixed_touch and bool(np.all(gains == 1.0)) and not np.any(offsets)

    def _add(self, sums_by_recording: np.ndarray, i: int, which: np.ndarray, y: np.ndarray) -> None:
        """Squared errors of the outputs y (M, k, s) of one recording."""
        e = self.experiments[i]
        error = np.where(e.counted[:, :, None], e.measured[:, :, None] - y, 0.0)
        error *= self.weights[i][:, None]
        sums_by_recording[i, which] = np.einsum("tks,tks->s", error, error)

    def _comparisons(
        self, group: PointGroup, numbers: Lanes, costs: np.ndarray
    ) -> list[Callable[[], None]]:
        """Jobs that fill costs (passes, LANES)."""
        target = self._target(group)
        if target.scale is not None:
            C, D = numbers.C * target.scale, numbers.D * target.scale
            numbers = Lanes(numbers.p, numbers.laws, C, D, numbers.x0)
        share = min(workers(), len(costs))
        edges = [len(costs) * i // share for i in range(share + 1)]
        return [
            partial(
                group.run, self.outputs.system, numbers, target.mode, target.measured,
                target.weights, costs, _NO_OUTPUTS, pair,
            )
            for pair in pairwise(edges)
        ]  # fmt: skip

    def _target(self, group: PointGroup) -> _Target:
        if group.members not in self._targets:
            self._targets[group.members] = self._new_target(group)
        return self._targets[group.members]

    def _new_target(self, group: PointGroup) -> _Target:
        chosen = [self.experiments[i] for i in group.members]
        weights = [self.weights[i] for i in group.members]
        measured = [np.nan_to_num(e.measured) for e in chosen]
        if all(e.counted.all() and len(e.measured) == group.samples for e in chosen):
            scaled = [y * w for y, w in zip(measured, weights, strict=True)]
            same = all(np.all(w == 1.0) for w in weights)
            scale = None if same else np.array(group.lanes(weights))[:, :, None]
            lanes = interleave(group.lanes(scaled), group.samples)
            return _Target(COMPARE, lanes.ravel(), np.zeros(0), scale)
        squares = []
        for e, w in zip(chosen, weights, strict=True):
            square = np.zeros((group.samples, e.measured.shape[1]))
            square[: len(e.measured)] = np.where(e.counted, w**2, 0.0)
            squares.append(square)
        lanes = interleave(group.lanes(measured), group.samples)
        weighed = interleave(group.lanes(squares), group.samples)
        return _Target(WEIGH, lanes.ravel(), weighed.ravel(), None)


def _unpack(group: PointGroup, costs: np.ndarray, sums_by_recording: np.ndarray) -> None:
    """From lanes to sums (recordings, S); the last pass repeats members."""
    count, size = len(group.members), sums_by_recording.shape[1]
    used = costs[:, : group.copies * count].reshape(-1, count)[:size]
    sums_by_recording[list(group.members)] = used.T
