"""The outputs of a linear model for many parameter vectors at once.

`LinearOutputs(experiments, unknowns, fixed).blocks(vectors)` is what Predictor.predict gives for
each vector, in one pass of compiled code over all of them. Where a recording's posture varies the
matrices are interpolated between a few postures; how much that changes an output is measured
against one exponential per sample where the object is made, and stated in `errors`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from core.drives.servo import FollowingServo
from core.effects.effect import Effect
from core.identify.lane_groups import LaneGroup, Plan, Size, lane_group
from core.identify.lane_numbers import LaneNumbers, Lanes, output_rows
from core.identify.lane_runs import share, stored
from core.identify.prepared import TORQUE, Prepared
from core.identify.processed import processed
from core.identify.unknowns import Unknowns
from core.simulate.postures import joints_that_matter, midpoints
from core.simulate.vector import LANES

POSTURE_TOLERANCE = 1e-6
"""Of a channel's rms: what following the posture may change an output by. A thousandth of the
noise at 60 dB, so that with a hundred thousand samples no estimate moves by a tenth of its
deviation."""

HIGHEST_DEGREE = 16
"""Of the interpolation; a sweep over most of the elbow's range needs about ten."""

MOST_NODES = 64
"""Beyond it one exponential per sample costs less."""

CHECK = 3
"""Degrees by which the interpolation that judges another one is higher."""


def applicable(experiments: Sequence[Prepared]) -> bool:
    """Whether all that is compared follows from linear outputs of the linear model."""
    return bool(experiments) and all(map(_linear, experiments))


def _linear(e: Prepared) -> bool:
    servo = isinstance(e.model.steering, FollowingServo)
    shown = servo and any(s.kind == TORQUE for s in e.outputs)
    moves = any(type(one).started is not Effect.started for one in e.model.effects)
    return (
        e.model.level == "lpv" and not shown and not moves
        and bool(e.outputs) and output_rows(e, e.model.numbers()) is not None
    )  # fmt: skip


class LinearOutputs:
    """blocks(vectors (S, P)) -> per recording (S, M, k), as Predictor.predict for each vector."""

    def __init__(
        self, experiments: Sequence[Prepared], unknowns: Unknowns, fixed: Mapping[str, float]
    ) -> None:
        self.experiments, self.unknowns, self.fixed = experiments, unknowns, fixed
        self.model = experiments[0].model
        self.numbers = LaneNumbers(experiments, unknowns, fixed)
        self.keep = self.numbers.states_that_matter()
        self.held = not self.model.numbers().law.interpolate
        self.errors: dict[str, float] = {}
        """Per recording: the largest change of a channel by following the posture, in units of
        its rms; none at a fixed working point."""
        self.plans = [Plan() for _ in experiments]
        for i, e in enumerate(experiments):
            self.plans[i] = self._plan(i, e)
        self._groups: dict[tuple[int, ...], LaneGroup] = {}

    def blocks(self, vectors: np.ndarray) -> list[np.ndarray]:
        """Processed outputs: per recording (S, M, k) for vectors (S, P)."""
        vectors = np.ascontiguousarray(np.atleast_2d(vectors), dtype=float)
        found = [np.empty((len(vectors), *e.measured.shape)) for e in self.experiments]

        def keep(i: int, s: np.ndarray, y: np.ndarray) -> None:
            found[i][s] = np.moveaxis(y, 2, 0)

        self.each(vectors, keep)
        return found

    def sensitivities(
        self, vector: np.ndarray, up: np.ndarray, down: np.ndarray
    ) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Outputs (M, k) and their slopes (M, k, P) at a vector, from the vectors up[j] and
        down[j] (P, P) that differ from it in entry j; all in one call."""
        P = len(vector)
        all_blocks = self.blocks(np.vstack([vector[None], up, down]))
        width = np.array([up[j, j] - down[j, j] for j in range(P)])
        slopes = [np.moveaxis(b[1 : 1 + P] - b[1 + P :], 0, 2) / width for b in all_blocks]
        return [b[0] for b in all_blocks], slopes

    def each(
        self, vectors: np.ndarray, take: Callable[[int, np.ndarray, np.ndarray], None]
    ) -> None:
        """take(recording, which vectors (s,), outputs (M, k, s)) for all recordings and vectors,
        from several threads, no pair of recording and vector twice."""
        jobs: list[Callable[[], None]] = []
        for group in self.groups(len(vectors)):
            numbers = self.numbers.lanes(group, vectors)
            packing = group.packing(len(vectors))
            for s in range(len(packing)):
                jobs.append(self._job(group, numbers, packing[s], s, vectors, take))
        share(jobs)

    def _job(  # noqa: PLR0913
        self, group: LaneGroup, numbers: Lanes, member: np.ndarray, s: int,
        vectors: np.ndarray, take: Callable[[int, np.ndarray, np.ndarray], None],
    ) -> Callable[[], None]:  # fmt: skip
        def job() -> None:
            linear = stored(self.model, group, numbers, self.keep, self.held, s)
            count = len(group.members)
            for r, i in enumerate(group.members):
                lanes = np.arange(r, group.copies * count, count)
                lanes = lanes[np.unique(member[lanes], return_index=True)[1]]
                e = self.experiments[i]
                values = [self.numbers.values(e, vectors[m]) for m in member[lanes]]
                y = linear[: len(e.task.time), :, lanes]
                p = numbers.p[s, lanes]
                take(i, member[lanes], processed(e, y, self.model.compiled, p, values))

        return job

    def groups(self, size: int) -> list[LaneGroup]:
        """The way of filling the lanes that takes least work for that many vectors."""
        kinds: dict[object, list[int]] = {}
        for i, e in enumerate(self.experiments):
            kinds.setdefault(self._kind(e), []).append(i)
        mixed = [
            tuple(some[a : a + LANES]) for some in kinds.values()
            for a in range(0, len(some), LANES)
        ]  # fmt: skip
        alone = [(i,) for i in range(len(self.experiments))]
        ways = [[self._group(members) for members in way] for way in (mixed, alone)]
        return min(ways, key=lambda way: sum(group.work(size) for group in way))

    def _kind(self, e: Prepared) -> object:
        """Recordings of one kind have the same rows of outputs."""
        return tuple(s.direct(e.recording, e.model.arm) for s in e.outputs)

    def _group(self, members: tuple[int, ...]) -> LaneGroup:
        if members not in self._groups:
            size = self._size(self.experiments[members[0]])
            self._groups[members] = lane_group(members, self.experiments, self.plans, size)
        return self._groups[members]

    def _size(self, e: Prepared) -> Size:
        numbers = self.model.numbers()
        rows = output_rows(e, numbers)
        assert rows is not None
        return Size(len(self.keep), numbers.law.references, len(rows[0]), self.held)

    def _plan(self, i: int, e: Prepared) -> Plan:
        """The lowest degree whose outputs at the start are those of a higher one."""
        if len(e.task.schedule) == 1:
            return Plan()
        start = self.unknowns.parameters.vector()
        numbers = self.model.numbers(self.numbers.values(e, start))
        joints = tuple(joints_that_matter(self.model, numbers, midpoints(e.task.schedule)))
        if not joints:
            return Plan()
        fine = self._followed(i, Plan(joints, 1 + CHECK), start)
        degree = 1
        while True:
            coarse, plan = self._followed(i, Plan(joints, degree), start), Plan(joints, degree)
            error = _largest(coarse - fine, fine)
            if error < POSTURE_TOLERANCE or degree >= HIGHEST_DEGREE:
                break
            degree += 1
            fine = self._followed(i, Plan(joints, degree + CHECK), start)
        self.errors[e.recording.name] = error
        return plan

    def _followed(self, i: int, plan: Plan, vector: np.ndarray) -> np.ndarray:
        """(M, k) of one recording with a plan."""
        plans = list(self.plans)
        plans[i] = plan
        e = self.experiments[i]
        group = lane_group((i,), self.experiments, plans, self._size(e))
        numbers = self.numbers.lanes(group, vector[None])
        linear = stored(self.model, group, numbers, self.keep, self.held, 0)[:, :, :1]
        values = [self.numbers.values(e, vector)]
        return processed(e, linear, self.model.compiled, numbers.p[0, :1], values)[:, :, 0]


def _largest(change: np.ndarray, y: np.ndarray) -> float:
    """The largest change over its channel's rms."""
    size = np.sqrt(np.mean(np.square(y), axis=0))
    return float(np.max(np.abs(change).max(axis=0) / np.where(size > 0.0, size, 1.0)))
