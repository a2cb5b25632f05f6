"""The weighted residuals of a set of recordings and their sensitivities."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from ..identify import linear_outputs
from ..identify.defect_correction import Anchor
from ..identify.linear_outputs import LinearOutputs
from ..identify.population_cost import PopulationCost
from ..identify.predictor import Predictor, Request
from ..identify.prepared_recording import Prepared
from ..identify.unknowns import Unknowns, is_neutral
from ..lanes.wide import LANES
from ..least_squares import zero_slopes
from ..progress import Compared, use_progress
from ..results import ChannelComparison, RecordingComparison

STEP = 1e-4
"""Relative step of central differences: truncation about 1e-8, rounding about 1e-10."""

ONE_SIDED_STEP = 1e-6
"""Relative step of one-sided differences, in a descent and at a bound; the uncertainty uses central
ones elsewhere."""


BATCH = 2 * LANES
"""Vectors simulated at once: they fill lanes and cores and fit into memory."""


def channel_weights(
    experiments: Sequence[Prepared], stated: Mapping[str, float]
) -> list[np.ndarray]:
    """(k,) per recording: 1 where all outputs share a unit, as in (13), else 1 over the spread
    of what was measured; a scenario's weight replaces either."""
    units = {unit for e in experiments for _, unit in e.channels}
    spread = _spreads(experiments)
    mixed = len(units) > 1
    weights = []
    for e in experiments:
        names = [name for name, _ in e.channels]
        weights.append(
            np.array([stated.get(n, 1.0 / spread[n] if mixed else 1.0) for n in names], dtype=float)
        )
    return weights


def _spreads(experiments: Sequence[Prepared]) -> dict[str, float]:
    collected: dict[str, list[np.ndarray]] = {}
    for e in experiments:
        for k, (name, _) in enumerate(e.channels):
            y = e.measured[e.counted[:, k], k]
            collected.setdefault(name, []).append(y - y.mean() if y.size else y)
    whole = {name: np.concatenate(parts) for name, parts in collected.items()}
    # A channel of which nothing counts, such as a torque that nobody recorded, has no spread.
    sizes = {name: float(np.std(y)) if y.size else 0.0 for name, y in whole.items()}
    return {name: size if size > 0.0 else 1.0 for name, size in sizes.items()}


@dataclass
class Residuals:
    """r(vector) over all recordings, only samples that count, times the channel's weight."""

    predictor: Predictor
    weights: Sequence[np.ndarray]
    anchor: Anchor | None = None
    """Error of few steps per sample, taken from one model; None: no correction."""
    on_better: Callable[[float, Compared], None] | None = None
    """Called with each lower cost, a mean square."""

    def report(self, vector: np.ndarray, cost: float) -> None:
        """Report a lower cost, a sum of squares, at a `vector` (P,)."""
        if self.on_better is not None:
            self.on_better(cost / max(self.count, 1), partial(self._compared, np.array(vector)))

    def _compared(self, vector: np.ndarray) -> RecordingComparison:
        e = self.experiments[0]
        with use_progress(None):
            (model,) = self._predicted([(vector, [0])])[0]
        channels = tuple(
            ChannelComparison(name, unit, e.time, e.measured[:, k], model[:, k], e.counted[:, k])
            for k, (name, unit) in enumerate(e.channels)
        )
        return RecordingComparison(e.recording.name, e.recording.role, "", channels)

    @property
    def experiments(self) -> Sequence[Prepared]:
        """The recordings that are compared."""
        return self.predictor.experiments

    @property
    def unknowns(self) -> Unknowns:
        """What is estimated."""
        return self.predictor.unknowns

    @cached_property
    def scales(self) -> np.ndarray:
        """(P,) typical size of each unknown, in its unit."""
        return self.unknowns.parameters.scales()

    def blocks(self, vector: np.ndarray) -> list[np.ndarray]:
        """Weighted errors (M_i, k) at a `vector` (P,), zero where a sample does not count."""
        return self.blocks_of([vector])[0]

    def blocks_of(self, vectors: Sequence[np.ndarray]) -> list[list[np.ndarray]]:
        """The blocks at each of several vectors, simulated together."""
        errors = self._blocks([(vector, range(len(self.experiments))) for vector in vectors])
        if self.anchor is None:
            return errors
        missed = self.anchor.correction(self.predictor.steps)
        return [[a + b for a, b in zip(blocks, missed, strict=True)] for blocks in errors]

    @cached_property
    def linear(self) -> LinearOutputs | None:
        """The outputs of many vectors in one pass, if all are linear."""
        if not linear_outputs.applicable(self.experiments):
            return None
        return LinearOutputs(self.experiments, self.unknowns, self.predictor.fixed)

    def _predicted(self, requests: Sequence[Request]) -> list[list[np.ndarray]]:
        if self.linear is None:
            return self.predictor.predict_many(requests)
        if not requests:
            return []
        each = self.linear.blocks(np.array([vector for vector, _ in requests]))
        return [[each[i][s] for i in which] for s, (_, which) in enumerate(requests)]

    def _blocks(self, requests: Sequence[Request]) -> list[list[np.ndarray]]:
        predicted = self._predicted(requests)
        return [
            [self._block(i, y) for i, y in zip(which, outputs, strict=True)]
            for (_, which), outputs in zip(requests, predicted, strict=True)
        ]

    def _block(self, i: int, predicted: np.ndarray) -> np.ndarray:
        e = self.experiments[i]
        error = np.where(e.counted, e.measured - predicted, 0.0)
        return np.asarray(e.standstill.removed_from(error) * self.weights[i])

    @property
    def counted(self) -> list[np.ndarray]:
        """(M_i, k) per recording: which samples count."""
        return [e.counted for e in self.experiments]

    def vector(self, blocks: Sequence[np.ndarray]) -> np.ndarray:
        """The blocks' counted samples in one vector (K,)."""
        return np.concatenate([b[c] for b, c in zip(blocks, self.counted, strict=True)])

    def __call__(self, vector: np.ndarray) -> np.ndarray:
        return self.vector(self.blocks(vector))

    @property
    def magnitude(self) -> float:
        """Sum of squares of the weighted outputs."""
        pairs = zip(self.experiments, self.weights, strict=True)
        return sum(float(np.sum((e.measured * w)[e.counted] ** 2)) for e, w in pairs)

    @property
    def count(self) -> int:
        """Number of samples that count, all channels together."""
        return int(sum(c.sum() for c in self.counted))

    def slopes(
        self, vector: np.ndarray, central: bool = True, only: Sequence[int] | None = None
    ) -> list[np.ndarray]:
        """d(residual)/d(vector) per recording, (M_i, k, P), by differences; zero for entries
        that are not among `only`, where that is given."""
        slopes = [zero_slopes(e.measured.shape, len(vector)) for e in self.experiments]
        columns = range(len(vector)) if only is None else only
        which = {j: self._concerned(j) for j in columns}
        for j, i, change in self._changes(vector, which, central):
            slopes[i][:, :, j] = change
        return slopes

    def _changes(
        self, vector: np.ndarray, which: Mapping[int, Sequence[int]], central: bool
    ) -> Iterator[tuple[int, int, np.ndarray]]:
        """(unknown, recording, change (M, k) of its residual); `which` recordings count for each
        unknown."""
        sides = {j: self._sides(vector, j, central) for j in which}
        up = [(sides[j][0], which[j]) for j in which]
        everything = sorted(set().union(*which.values()))
        down = [(sides[j][1], which[j]) for j in which] if central else [(vector, everything)]
        # Outputs before filters, or behind them if all are linear; together they fill the lanes.
        read = self.predictor.readings if self.linear is None else self._predicted
        both = read([*up, *down])
        for at, (j, (above, below)) in enumerate(sides.items()):
            row, rows_of = (len(up) + at, which[j]) if central else (len(up), everything)
            for k, i in enumerate(which[j]):
                change = both[at][k] - both[row][rows_of.index(i)]
                yield j, i, self._change(i, change / (above[j] - below[j]))

    def _change(self, i: int, change: np.ndarray) -> np.ndarray:
        """(M, k) change of the residual by a change of the readings."""
        e = self.experiments[i]
        output_change = e.processed_change(change) if self.linear is None else change
        error = np.where(e.counted, -output_change, 0.0)
        return np.asarray(e.standstill.removed_from(error) * self.weights[i])

    def _sides(self, vector: np.ndarray, j: int, central: bool) -> tuple[np.ndarray, np.ndarray]:
        """Two vectors that differ in entry j, inside the bounds."""
        item, scale, at = self.unknowns.items[j].parameter, self.scales[j], vector[j]
        up, down = vector.copy(), vector.copy()
        if central and item.lower <= at - STEP * scale and at + STEP * scale <= item.upper:
            up[j], down[j] = at + STEP * scale, at - STEP * scale
        else:
            step = ONE_SIDED_STEP * scale
            up[j] = at + step if at + step <= item.upper else at - step
        return up, down

    def _concerned(self, j: int) -> list[int]:
        own = self.unknowns.items[j].recording
        names = [e.recording.name for e in self.experiments]
        return [i for i, name in enumerate(names) if own in (None, name)]

    def population(self, at: np.ndarray | None = None) -> PopulationCost | None:
        """The fast cost of many vectors, where it is exact. It ignores offsets, gains and initial
        deviations: they must be neutral at `at` (P,), or at the start if none is given."""
        vector = self.unknowns.parameters.vector() if at is None else at
        values = [self.predictor.values(e, vector) for e in self.experiments]
        if not all(map(is_neutral, values)) or not linear_outputs.applicable(self.experiments):
            return None
        return PopulationCost(self.experiments, self.weights, self.unknowns, self.predictor.fixed)

    def costs(self, vectors: np.ndarray) -> np.ndarray:
        """(S,) sums of squares by plain simulation, a few vectors at a time."""
        sums = []
        for first in range(0, len(vectors), BATCH):
            some = self.blocks_of(list(vectors[first : first + BATCH]))
            sums += [sum(float(np.sum(b * b)) for b in blocks) for blocks in some]
        return np.array(sums)
