"""The outputs of a linear model for many parameter vectors at once.

`LinearOutputs(experiments, unknowns, fixed).blocks(vectors)` equals Predictor.predict for each
vector, in one pass of compiled code. If a recording's posture varies, matrices are interpolated
between a few postures; the error is measured once against one exponential per sample and stated in
`errors`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import comb

import numpy as np

from ..arm.compiled import CompiledArm
from ..effects.effect import Effect
from ..identify.lane_groups import (
    FollowedGroup,
    Group,
    Lanes,
    PointGroup,
    System,
    followed_group,
    point_group,
    share,
)
from ..identify.lane_numbers import LaneNumbers, output_rows
from ..identify.prepared_recording import Prepared
from ..identify.processing import TORQUE
from ..identify.unknowns import GAIN, OFFSET, Unknowns
from ..lanes.wide import LANES
from ..simulate.linear import respond
from ..simulate.posture_interpolation import interpolation, joints_that_matter, midpoints

POSTURE_TOLERANCE = 1e-6
"""Share of a channel's rms: largest error of the interpolation. A thousandth of the noise at 60 dB,
so that with 100,000 samples no estimate moves by a tenth of its standard deviation."""

MOST_NODES = 40
"""Most postures of the interpolation: a sweep of the elbow needs a dozen; with more, one
exponential per sample costs less."""

CHECK = 3
"""Least degrees by which the reference interpolation is higher."""


def applicable(experiments: Sequence[Prepared]) -> bool:
    """Whether there are outputs of the linear model to be predicted."""
    return bool(experiments) and all(e.model.level == "lpv" and e.outputs for e in experiments)


def _has_rows(e: Prepared) -> bool:
    """Whether all compared outputs are linear along the recording's posture."""
    shown = e.model.steering is not None and any(s.kind == TORQUE for s in e.outputs)
    moves = any(type(effect).started is not Effect.started for effect in e.model.effects)
    return not shown and not moves and output_rows(e, e.model.numbers()) is not None


def _is_unprocessed(e: Prepared) -> bool:
    """Whether the linear outputs are compared unprocessed."""
    arm = e.model.arm
    sensed = any(type(effect).sensed is not Effect.sensed for effect in e.model.effects)
    touched = sensed or bool(e.recording.logger_filters) or bool(e.recording.camera.delay)
    linear = all(s.is_linear(e.recording, arm) for s in e.outputs)
    return linear and e.processing.nothing and not touched


Take = Callable[[int, np.ndarray, np.ndarray], None]
Job = Callable[[], None]


class LinearOutputs:
    """blocks(vectors (S, P)) -> per recording (S, M, k), as Predictor.predict for each vector."""

    def __init__(
        self, experiments: Sequence[Prepared], unknowns: Unknowns, fixed: Mapping[str, float]
    ) -> None:
        self.experiments, self.unknowns, self.fixed = experiments, unknowns, fixed
        self.numbers = LaneNumbers(experiments, unknowns, fixed)
        self.model = self.numbers.model
        self._simulated = {i for i, e in enumerate(experiments) if not _has_rows(e)}
        """Recordings with one exponential per sample."""
        held_references = not self.model.numbers().law.interpolate
        self.system = System(self.model, self.numbers.states_that_matter(), held_references)
        self.errors: dict[str, float] = {}
        """Per recording: the largest change of a channel by following the posture, in units of
        its rms; none at a fixed working point."""
        self._followed: dict[int, FollowedGroup] = {}
        share([partial(self._begin, i) for i in range(len(experiments))])
        others = {*self._followed, *self._simulated}
        self.plain = [i not in others and _is_unprocessed(e) for i, e in enumerate(experiments)]
        """Per recording: whether nothing happens to its linear outputs, gains and offsets apart."""
        self._points: dict[tuple[int, ...], PointGroup] = {}
        self._ways: dict[int, list[Group]] = {}

    def blocks(self, vectors: np.ndarray) -> list[np.ndarray]:
        """Processed outputs: per recording (S, M, k) for vectors (S, P)."""
        vectors = np.ascontiguousarray(np.atleast_2d(vectors), dtype=float)
        outputs = [np.empty((len(vectors), *e.measured.shape)) for e in self.experiments]

        def keep(i: int, s: np.ndarray, y: np.ndarray) -> None:
            outputs[i][s] = np.moveaxis(y, 2, 0)

        self.each(vectors, keep)
        return outputs

    def each(self, vectors: np.ndarray, take: Take) -> None:
        """take(recording, which vectors (s,), outputs (M, k, s)) for all recordings and vectors,
        from several threads, no pair of recording and vector twice."""
        jobs: list[Callable[[], None]] = []
        for group in self.groups(len(vectors)):
            jobs += self.jobs(group, self.numbers.lanes(group, vectors), vectors, take)
        share([*jobs, *self.simulations(vectors, take)])

    def jobs(self, group: Group, numbers: Lanes, vectors: np.ndarray, take: Take) -> list[Job]:
        """One per pass of a group, for `vectors` (S, P); `take` as in `each`."""
        passes = range(len(numbers.p))
        return [partial(self._pass, group, numbers, s, vectors, take) for s in passes]

    def simulations(self, vectors: np.ndarray, take: Take) -> list[Job]:
        """Jobs for the recordings that take the exact way, in no group, and `vectors` (S, P)."""
        parts = [np.arange(a, min(a + LANES, len(vectors))) for a in range(0, len(vectors), LANES)]
        return [
            partial(self._simulate, i, part, vectors, take)
            for i in sorted(self._simulated) for part in parts
        ]  # fmt: skip

    def _simulate(self, i: int, which: np.ndarray, vectors: np.ndarray, take: Take) -> None:
        e = self.experiments[i]
        values = [self.numbers.values(e, vectors[m]) for m in which]
        numbers = [e.model.numbers(v) for v in values]
        motions = respond(e.model, numbers, [e.task_at(v) for v in values])
        each = [e.predicted(*parts) for parts in zip(motions, numbers, values, strict=True)]
        take(i, which, np.stack(each, axis=2))

    def _pass(self, group: Group, numbers: Lanes, s: int, vectors: np.ndarray, take: Take) -> None:
        recordings, copies = len(group.members), group.copies
        first = s * copies
        count = min(copies, len(vectors) - first)
        linear = group.outputs(self.system, numbers, s, count)
        which = np.arange(first, first + count)
        for r, i in enumerate(group.members):
            lanes = slice(r, r + count * recordings, recordings)
            e = self.experiments[i]
            values = [self.numbers.values(e, vectors[m]) for m in which]
            y = linear[: len(e.task.time), :, lanes]
            p = numbers.p[s, lanes]
            take(i, which, processed(e, y, self.model.compiled, p, values))

    def groups(self, size: int) -> list[Group]:
        """The way of filling the lanes that takes least work for that many vectors."""
        if size not in self._ways:
            kinds: dict[object, list[int]] = {}
            for i in range(len(self.experiments)):
                if i not in self._followed and i not in self._simulated:
                    kinds.setdefault(self._kind(i), []).append(i)
            point_groups = [group for some in kinds.values() for group in self._filled(some, size)]
            self._ways[size] = [*(self._followed[i] for i in sorted(self._followed)), *point_groups]
        return self._ways[size]

    def _filled(self, some: Sequence[int], size: int) -> list[PointGroup]:
        """Recordings of one kind side by side, or each for itself."""
        mixed = [tuple(some[a : a + LANES]) for a in range(0, len(some), LANES)]
        ways = [[self._point(m) for m in way] for way in (mixed, [(i,) for i in some])]
        return min(ways, key=lambda way: sum(group.work(size) for group in way))

    def _kind(self, i: int) -> object:
        """Recordings of one kind have the same rows of outputs."""
        e = self.experiments[i]
        return self.plain[i], *(s.direct(e.recording, e.model.arm) for s in e.outputs)

    def _point(self, members: tuple[int, ...]) -> PointGroup:
        if members not in self._points:
            rows = output_rows(self.experiments[members[0]], self.model.numbers())
            assert rows is not None
            self._points[members] = point_group(
                members, self.experiments, self.system, len(rows[0])
            )
        return self._points[members]

    def _begin(self, i: int) -> None:
        """Finds out how recording i is computed."""
        e = self.experiments[i]
        if i in self._simulated or len(e.task.schedule) == 1:
            return
        points, start = midpoints(e.task.schedule), self.unknowns.parameters.vector()
        numbers = self.model.numbers(self.numbers.values(e, start))
        joints = joints_that_matter(self.model, numbers, points)
        if not joints:
            return
        group, error = self._follow(i, points, joints)
        if error < POSTURE_TOLERANCE:
            self._followed[i], self.errors[e.recording.name] = group, error
        else:
            self._simulated.add(i)

    def _follow(self, i: int, points: np.ndarray, joints: list[int]) -> tuple[FollowedGroup, float]:
        """The lowest sufficient degree at the start vector, and its largest error."""
        start = self.unknowns.parameters.vector()

        def with_degree(degree: int) -> tuple[FollowedGroup, np.ndarray]:
            nodes = interpolation(points, joints, degree)
            group = followed_group(i, self.experiments, nodes)
            return group, self._outputs_at(group, start)

        degree, reference = 0, 0
        while True:
            degree += 1
            if degree + CHECK > reference:
                reference = 2 * (degree + CHECK)
                _, exact = with_degree(reference)
            group, y = with_degree(degree)
            error = _largest_relative(y - exact, exact)
            more = comb(degree + 1 + len(joints), len(joints))
            if error < POSTURE_TOLERANCE or more > MOST_NODES:
                return group, error

    def _outputs_at(self, group: FollowedGroup, vector: np.ndarray) -> np.ndarray:
        """(M, k) of a group's recording."""
        outputs = []
        numbers = self.numbers.lanes(group, vector[None])
        self._pass(group, numbers, 0, vector[None], lambda i, which, y: outputs.append(y[:, :, 0]))
        return np.asarray(outputs[0])


def _largest_relative(change: np.ndarray, y: np.ndarray) -> float:
    """The largest change over its channel's rms."""
    size = np.sqrt(np.mean(np.square(y), axis=0))
    return float(np.max(np.abs(change).max(axis=0) / np.where(size > 0.0, size, 1.0)))


Values = Sequence[Mapping[str, float]]


def processed(
    e: Prepared, linear: np.ndarray, compiled: CompiledArm, p: np.ndarray, values: Values
) -> np.ndarray:
    """(M, k, S) from the linear outputs (N, k', S) of S motions with p (S, np) and `values`."""
    raw = _sensed(e, linear, compiled, p, values)
    for k, (name, _) in enumerate(e.channels):
        raw[:, k] = e.through_logger(name, raw[:, k])
        gain = np.array([v.get(GAIN + name, 1.0) for v in values])
        offset = np.array([v.get(OFFSET + name, 0.0) for v in values])
        if np.any(gain != 1.0) or np.any(offset):
            raw[:, k] = gain * raw[:, k] + offset
    return e.processed(raw)


def _sensed(
    e: Prepared, linear: np.ndarray, compiled: CompiledArm, p: np.ndarray, values: Values
) -> np.ndarray:
    """(N, k, S): what the sensors read."""
    arm, readings, place = e.model.arm, [], 0
    numbers = e.model.numbers()
    for sensor in e.outputs:
        rows = sensor.linear_rows(e.recording, arm, numbers.p, numbers.law)
        assert rows is not None
        count = len(rows.Q)
        part = linear[:, place : place + count]
        place += count
        y = sensor.from_linear(part, e.recording, arm, compiled, p)
        readings.append(_through_effects(e, sensor.kind, y, values))
    return np.concatenate(readings, axis=1)


def _through_effects(e: Prepared, kind: str, y: np.ndarray, values: Values) -> np.ndarray:
    if all(type(effect).sensed is Effect.sensed for effect in e.model.effects):
        return y
    each = [e.sensed_by(kind, y[:, :, s], v) for s, v in enumerate(values)]
    return np.stack(each, axis=2)
