"""The cost of a whole population at once, for linear models at working points.

The cost (13) of every member over every recording is one compiled call that holds no lock.
Members and recordings share the lanes of the vector unit: seven recordings take seven lanes of
eight; a single recording is run for eight members at a time.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import TypeVar

import numpy as np

from core.identify import predictor
from core.identify.prepared import Prepared
from core.identify.unknowns import START, Unknowns
from core.model import Model, Numbers
from core.simulate import lpv
from core.simulate.linear import interleave
from core.simulate.vector import LANES

T = TypeVar("T")
LAW_NAMES = ("R", "P", "V", "S", "Fs", "Fq", "Fv", "Fr")


def applicable(experiments: Sequence[Prepared], unknowns: Unknowns) -> bool:
    """Whether the fast cost is exact here: a linear model at fixed working points, outputs that
    are linear and recorded as they are, nothing filtered, one law of hold."""
    return all(_plain(e) for e in experiments) and not any(
        item.parameter.name.startswith(START) and item.searched for item in unknowns.items
    )


def _plain(e: Prepared) -> bool:
    law = e.model.numbers().law
    linear = not e.model.effects and e.model.level == "lpv" and len(e.task.schedule) == 1
    direct = all(
        s.direct(e.recording, e.model.arm) and s.rows(e.model.arm, e.model.numbers().p, law)
        for s in e.outputs
    )
    touched = bool(e.recording.logger_filters) or bool(e.recording.camera.delay)
    return linear and direct and e.processing.nothing and not touched


@dataclass(frozen=True)
class _Group:
    """Up to LANES recordings, repeated so that they fill the lanes."""

    members: tuple[int, ...]
    copies: int
    schedule: np.ndarray
    h: np.ndarray
    x0: np.ndarray
    references: np.ndarray
    measured: np.ndarray
    weights: np.ndarray

    def lanes(self, values: Sequence[T]) -> list[T]:
        """One value per lane from one per recording, copies and fillers included."""
        filled = list(values) * self.copies
        return filled + [values[0]] * (LANES - len(filled))

    def packing(self, size: int) -> np.ndarray:
        """(passes, LANES): which of `size` population members each lane has; the last pass
        repeats the last member."""
        passes = -(-size // self.copies)
        order = np.minimum(np.arange(passes * self.copies), size - 1).reshape(passes, self.copies)
        copy = np.arange(LANES) // len(self.members)
        return np.asarray(order[:, np.where(copy < self.copies, copy, 0)])


def _rows_that_differ(weights: np.ndarray) -> np.ndarray:
    """(1, k, LANES) where all samples weigh the same: a third less to read from memory."""
    same = bool(np.all(weights == weights[:1]))
    return weights[:1] if same else weights


@cache
def _pool() -> ThreadPoolExecutor:
    """Made once: starting threads takes longer than a small cost."""
    return ThreadPoolExecutor(predictor.WORKERS, thread_name_prefix="cost")


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pool.cache_clear)  # its threads stay with the parent


class PopulationCost:
    """costs(vectors (S, P)) -> (S,), the weighted squared error over all recordings.

    Offsets and gains keep their start here; they enter linearly and are left to refinement.
    """

    def __init__(
        self,
        experiments: Sequence[Prepared],
        weights: Sequence[np.ndarray],
        unknowns: Unknowns,
        fixed: Mapping[str, float],
    ) -> None:
        self.experiments, self.unknowns, self.fixed = experiments, unknowns, fixed
        self.model: Model = experiments[0].model
        self._workers: int | None = None
        self.held = not self.model.numbers().law.interpolate
        self.keep = self._states_that_matter()
        indices = range(len(experiments))
        chunks = [tuple(indices[i : i + LANES]) for i in range(0, len(indices), LANES)]
        self.groups = [self._group(chunk, weights) for chunk in chunks]
        names = {item.parameter.name for item in unknowns.items}
        arm_names = self.model.arm_catalogue.entries
        self.own_parameters = any(item.recording is not None for item in unknowns.items)
        self._seen: dict[str, tuple[list[str], np.ndarray, np.ndarray]] = {}
        self._cached: dict[tuple[tuple[int, ...], int], tuple] = {}
        self.rows_vary = any(n not in arm_names or n.startswith("l") for n in names)

    @property
    def workers(self) -> int:
        """Threads; as many as all predictions take, unless they were set."""
        return predictor.WORKERS if self._workers is None else self._workers

    @workers.setter
    def workers(self, number: int) -> None:
        self._workers = number

    def __call__(self, vectors: np.ndarray) -> np.ndarray:
        vectors = np.ascontiguousarray(np.atleast_2d(vectors), dtype=float)
        return np.sum([self._group_costs(group, vectors) for group in self.groups], axis=0)

    def _states_that_matter(self) -> np.ndarray:
        """Indices of the states that outputs see, directly or through other states."""
        model, e = self.model, self.experiments[0]
        p, law, _ = model.numbers()
        C, _ = self._rows(e, Numbers(p, law))
        n, states = model.arm.coordinates, 2 * model.arm.coordinates + law.states
        K, D = model.compiled.linear_matrices(e.task.schedule[0], p)
        feedback = np.zeros((n, states))
        feedback[:, :n] = np.abs(K)
        feedback[:, n : 2 * n] = np.abs(D)
        joints = model.arm.joints
        feedback[:joints] += np.abs(np.hstack([law.P, law.V, law.S]))
        # The inverse of M couples every coordinate of an arm to every other.
        spread = np.tile(feedback.sum(axis=0), (n, 1))
        own = np.hstack([law.Fq, law.Fv, law.Fs])
        A = np.vstack([np.eye(n, states, k=n), spread, own]) != 0.0
        seen = np.any(C != 0.0, axis=0)
        for _ in range(states):
            seen = seen | np.any(A[seen], axis=0)
        return np.flatnonzero(seen)

    def _rows(self, e: Prepared, numbers: Numbers) -> tuple[np.ndarray, np.ndarray]:
        """C (k, states) and D (k, nr) of the compared outputs."""
        parts = [s.rows(e.model.arm, numbers.p, numbers.law) for s in e.outputs]
        C = np.vstack([np.hstack([r.Q, r.V, r.S]) for r in parts if r is not None])
        return C, np.vstack([r.R for r in parts if r is not None])

    def _group(self, chunk: tuple[int, ...], weights: Sequence[np.ndarray]) -> _Group:
        chosen = [self.experiments[i] for i in chunk]
        copies = max(LANES // len(chosen), 1)
        length = max(len(e.task.time) for e in chosen)
        draft = _Group(chunk, copies, *([np.empty(0)] * 6))
        scaled = []
        for i, e in zip(chunk, chosen, strict=True):
            weight = np.zeros((length, e.measured.shape[1]))
            weight[: len(e.measured)] = np.where(e.counted, weights[i] ** 2, 0.0)
            scaled.append(weight)
        lanes = draft.lanes(scaled)
        used = copies * len(chosen)
        lanes[used:] = [np.zeros_like(lanes[0])] * (LANES - used)
        measured = [np.nan_to_num(e.measured) for e in chosen]
        return _Group(
            chunk,
            copies,
            np.ascontiguousarray([draft.lanes([e.task.schedule[0] for e in chosen])]),
            np.array(draft.lanes([np.array(e.recording.sample_time) for e in chosen])),
            np.array(draft.lanes([e.task.start for e in chosen])),
            interleave(draft.lanes([e.task.references for e in chosen]), length + 1).ravel(),
            interleave(draft.lanes(measured), length).ravel(),
            _rows_that_differ(interleave(lanes, length)).ravel(),
        )

    def _values(self, e: Prepared, vector: np.ndarray) -> dict[str, float]:
        return {**self.fixed, **self.unknowns.values_for(e.recording.name, vector)}

    def _arm_vectors(self, e: Prepared, vectors: np.ndarray) -> np.ndarray:
        """p (S, np) as one recording sees the vectors."""
        name = e.recording.name
        if name not in self._seen:
            concerned = self.unknowns.concerning(name)
            pairs = zip(self.unknowns.items, concerned, strict=True)
            fixed = {k: v for k, v in self.fixed.items() if k in self.model.parameters}
            names = [*[u.parameter.name for u, c in pairs if c], *fixed]
            self._seen[name] = (names, concerned, np.array([*fixed.values()], dtype=float))
        names, concerned, held = self._seen[name]
        own = vectors if concerned.all() else vectors[:, concerned]
        if held.size:
            own = np.hstack([own, np.broadcast_to(held, (len(own), held.size))])
        return self.model.arm_vectors(names, own)

    def _group_costs(self, group: _Group, vectors: np.ndarray) -> np.ndarray:
        """Members are packed `copies` at a time into passes of LANES lanes."""
        size, copies, count = len(vectors), group.copies, len(group.members)
        passes = -(-size // copies)
        lane_member = group.packing(size)
        p = self._packed_vectors(group, vectors, lane_member)
        if self.rows_vary:
            laws, C, D = self._varying_rows(group, vectors, lane_member)
        else:
            laws, C, D = self._constant_rows(group, passes)
        costs = np.empty((passes, LANES))
        self._run(group, p, laws, C, D, costs)
        used = costs[:, : copies * count].reshape(passes, copies, count).sum(axis=2)
        return np.asarray(used.reshape(-1)[:size])

    def _packed_vectors(
        self, group: _Group, vectors: np.ndarray, lane_member: np.ndarray
    ) -> np.ndarray:
        """p (passes, LANES, np): each lane has its member's, as its recording sees it."""
        if not self.own_parameters:
            p = self._arm_vectors(self.experiments[group.members[0]], vectors)
            return np.ascontiguousarray(p[lane_member])
        each = [self._arm_vectors(self.experiments[i], vectors) for i in group.members]
        recording = np.array(group.lanes(list(range(len(each)))))
        return np.ascontiguousarray(np.array(each)[recording[None, :], lane_member])

    def _constant_rows(self, group: _Group, passes: int) -> tuple:
        """Laws and outputs that no member changes; made once per number of passes."""
        key = (group.members, passes)
        if key not in self._cached:
            law = self.model.numbers(self.fixed).law
            numbers = Numbers(self.model.numbers(self.fixed).p, law)
            e = self.experiments[group.members[0]]
            C, D = self._rows(e, numbers)
            shape = (passes, LANES, 1, 1)
            laws = tuple(np.tile(getattr(law, name), shape) for name in LAW_NAMES)
            self._cached[key] = (laws, np.tile(C, shape), np.tile(D, shape))
        return self._cached[key]

    def _varying_rows(self, group: _Group, vectors: np.ndarray, lane_member: np.ndarray) -> tuple:
        """Laws and outputs of each member and recording."""
        chosen = [self.experiments[i] for i in group.members]
        numbers = [[e.model.numbers(self._values(e, v)) for v in vectors] for e in chosen]
        rows = [
            [self._rows(e, each) for each in some] for e, some in zip(chosen, numbers, strict=True)
        ]
        recording = group.lanes(list(range(len(chosen))))
        pairs = [[(recording[k], s) for k, s in enumerate(some)] for some in lane_member]

        def gather(pick):  # type: ignore[no-untyped-def]
            return np.ascontiguousarray([[pick(r, s) for r, s in some] for some in pairs], float)

        laws = tuple(
            gather(lambda r, s, name=name: getattr(numbers[r][s].law, name)) for name in LAW_NAMES
        )
        return laws, gather(lambda r, s: rows[r][s][0]), gather(lambda r, s: rows[r][s][1])

    def _run(self, group, p, laws, C, D, costs):  # type: ignore[no-untyped-def]
        compiled = self.model.compiled

        def part(first: int, last: int) -> None:
            lpv.population_costs(
                compiled.dynamics, compiled.linear, p, laws, C, D, group.schedule, group.h,
                self.keep, self.held, group.x0, group.references, group.measured, group.weights,
                costs, first, last,
            )  # fmt: skip

        share = min(self.workers, len(p))
        edges = [len(p) * i // share for i in range(share + 1)]
        others = [_pool().submit(part, *pair) for pair in pairwise(edges[1:])]
        part(*edges[:2])
        for other in others:
            other.result()
