"""The numbers of many parameter vectors, laid out for the lanes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..drives.law import DriveLaw
from ..identify.first_states import START
from ..identify.lane_groups import Group, Lanes
from ..identify.prepared_recording import Prepared
from ..identify.unknowns import GAIN, OFFSET, Unknowns
from ..lanes.wide import LANES
from ..model import Model, Numbers
from ..simulate.linear import with_forces
from ..simulate.motion import full_start

LAW_NAMES = ("R", "P", "V", "S", "Fs", "Fq", "Fv", "Fr")

GENERIC = 0.1234
"""A move in units of a parameter's scale, at which nothing vanishes by chance."""


def output_rows(e: Prepared, numbers: Numbers) -> tuple[np.ndarray, np.ndarray] | None:
    """C (k, states) and D (k, nr) of what the outputs are computed from; None where some output
    needs a whole motion."""
    arm, p, law = e.model.arm, numbers.p, numbers.law
    parts = [s.linear_rows(e.recording, arm, p, law) for s in e.outputs]
    if any(r is None for r in parts):
        return None
    C = np.vstack([np.hstack([r.Q, r.V, r.S]) for r in parts if r is not None])
    return C, np.vstack([r.R for r in parts if r is not None])


class LaneNumbers:
    """Numbers of vectors (S, P) for groups of recordings; what no vector changes is kept."""

    def __init__(
        self, experiments: Sequence[Prepared], unknowns: Unknowns, fixed: Mapping[str, float]
    ) -> None:
        self.experiments, self.unknowns, self.fixed = experiments, unknowns, fixed
        self.model: Model = experiments[0].model
        names = {item.parameter.name for item in unknowns.items}
        names = {n for n in names if not n.startswith((OFFSET, GAIN))}
        arm_names = self.model.arm_catalogue.entries
        outside = any(n not in arm_names or n.startswith("l") for n in names)
        self.rows_vary = bool(self.model.effects) or outside
        self.starts_vary = bool(self.model.effects) or any(
            n.startswith(START) for n in (*names, *fixed)
        )
        self.own_parameters = any(item.recording is not None for item in unknowns.items)
        self._seen: dict[str, tuple[list[str], np.ndarray, np.ndarray]] = {}
        self._kept: dict[tuple[object, ...], tuple[np.ndarray, ...]] = {}

    def values(self, e: Prepared, vector: np.ndarray) -> dict[str, float]:
        """name -> value as a recording sees the vector (P,)."""
        return {**self.fixed, **self.unknowns.values_for(e.recording.name, vector)}

    def generic(self) -> np.ndarray:
        """(P,) near the start, with nothing zero that a vector may change."""
        parameters = self.unknowns.parameters
        moved = parameters.vector() + GENERIC * parameters.scales()
        inside = 0.5 * (parameters.vector() + parameters.upper())
        return np.where(moved <= parameters.upper(), moved, inside)

    def states_that_matter(self) -> np.ndarray:
        """(nx,) indices of the states that outputs see, directly or through other states."""
        visible = [self._seen_states(e) for e in self.experiments]
        return np.flatnonzero(np.any(visible, axis=0))

    def _seen_states(self, e: Prepared) -> np.ndarray:
        model, values = self.model, self.values(e, self.generic())
        numbers = model.numbers(values)
        rows = output_rows(e, numbers)
        law = with_forces(numbers, e.task)
        n, states = model.arm.coordinates, 2 * model.arm.coordinates + law.states
        # A posture of no symmetry: gravity may have no slope where the recording starts.
        K, D = model.compiled.linear_matrices(e.task.schedule[0] + GENERIC, numbers.p)
        feedback = np.zeros((n, states))
        feedback[:, :n] = np.abs(K)
        feedback[:, n : 2 * n] = np.abs(D)
        feedback[: len(law.P)] += np.abs(np.hstack([law.P, law.V, law.S]))
        # The inverse of M couples every coordinate of an arm to every other.
        spread = np.tile(feedback.sum(axis=0), (n, 1))
        own = np.hstack([law.Fq, law.Fv, law.Fs])
        A = np.vstack([np.eye(n, states, k=n), spread, own]) != 0.0
        visible = np.ones(states, dtype=bool) if rows is None else np.any(rows[0] != 0.0, axis=0)
        for _ in range(states):
            visible = visible | np.any(A[visible], axis=0)
        return visible

    def lanes(self, group: Group, vectors: np.ndarray) -> Lanes:
        """Of all passes that the vectors (S, P) need."""
        packing = group.packing(len(vectors))
        if self.rows_vary:
            return self._each(group, vectors, packing)
        laws, C, D = self._constant(group, len(packing))
        p = self._packed_vectors(group, vectors, packing)
        return Lanes(p, laws, C, D, self._starts(group, vectors, packing))

    def _arm_vectors(self, e: Prepared, vectors: np.ndarray) -> np.ndarray:
        """p (S, np) as one recording sees the vectors."""
        name = e.recording.name
        if name not in self._seen:
            concerned = self.unknowns.concerning(name)
            pairs = zip(self.unknowns.items, concerned, strict=True)
            fixed = {k: v for k, v in self.fixed.items() if k in self.model.parameters}
            names = [*[u.parameter.name for u, c in pairs if c], *fixed]
            self._seen[name] = (names, concerned, np.array([*fixed.values()], dtype=float))
        names, concerned, fixed_values = self._seen[name]
        own = vectors if concerned.all() else vectors[:, concerned]
        if fixed_values.size:
            own = np.hstack([own, np.broadcast_to(fixed_values, (len(own), fixed_values.size))])
        return self.model.arm_vectors(names, own)

    def _packed_vectors(self, group: Group, vectors: np.ndarray, packing: np.ndarray) -> np.ndarray:
        """p (passes, LANES, np): each lane has its member's, as its recording sees it."""
        if not self.own_parameters:
            p = self._arm_vectors(self.experiments[group.members[0]], vectors)
            return np.ascontiguousarray(p[packing])
        each = [self._arm_vectors(self.experiments[i], vectors) for i in group.members]
        recording = np.array(group.lanes(list(range(len(each)))))
        return np.ascontiguousarray(np.array(each)[recording[None, :], packing])

    def _constant(self, group: Group, passes: int) -> tuple[Any, ...]:
        """Laws and outputs that no member changes; made once per number of passes."""
        key = ("rows", group.members, passes)
        if key not in self._kept:
            numbers = self.model.numbers(self.fixed)
            rows = output_rows(self.experiments[group.members[0]], numbers)
            assert rows is not None
            shape = (passes, LANES, 1, 1)
            laws = [np.tile(getattr(numbers.law, name), shape) for name in LAW_NAMES]
            self._kept[key] = (*laws, *(np.tile(each, shape) for each in rows))
        *laws, C, D = self._kept[key]
        return tuple(laws), C, D

    def _starts(self, group: Group, vectors: np.ndarray, packing: np.ndarray) -> np.ndarray:
        """x0 (passes, LANES, N) without effects."""
        if not self.starts_vary:
            key = ("starts", group.members, len(packing))
            if key not in self._kept:
                starts = group.lanes([self.experiments[i].task.start for i in group.members])
                self._kept[key] = (np.tile(np.array(starts), (len(packing), 1, 1)),)
            return self._kept[key][0]
        chosen = [self.experiments[i] for i in group.members]
        each = np.array([[e.task_at(self.values(e, v)).start for v in vectors] for e in chosen])
        recording = np.array(group.lanes(list(range(len(chosen)))))
        return np.ascontiguousarray(each[recording[None, :], packing])

    def _each(self, group: Group, vectors: np.ndarray, packing: np.ndarray) -> Lanes:
        """Where members change laws, outputs or effects: one by one."""
        chosen = [self.experiments[i] for i in group.members]
        shared = not (self.own_parameters or self.model.effects or self.starts_vary)
        members = [[_Member.of(e, self.values(e, v)) for v in vectors]
                 for e in (chosen[:1] if shared else chosen)]  # fmt: skip
        recording = [0 if shared else r for r in group.lanes(list(range(len(chosen))))]
        pairs = [[members[recording[k]][s] for k, s in enumerate(some)] for some in packing]

        def gather(name: str) -> np.ndarray:
            return np.ascontiguousarray(
                [[getattr(member, name) for member in some] for some in pairs], dtype=float
            )

        laws = tuple(
            np.ascontiguousarray(
                [[getattr(member.law, k) for member in some] for some in pairs], float
            )
            for k in LAW_NAMES
        )
        x0 = self._starts(group, vectors, packing) if shared else gather("start")
        return Lanes(gather("p"), laws, gather("C"), gather("D"), x0)


@dataclass(frozen=True)
class _Member:
    """One vector's numbers for one recording."""

    p: np.ndarray
    law: DriveLaw
    C: np.ndarray
    D: np.ndarray
    start: np.ndarray

    @classmethod
    def of(cls, e: Prepared, values: Mapping[str, float]) -> _Member:
        numbers, task = e.model.numbers(values), e.task_at(values)
        rows = output_rows(e, numbers)
        assert rows is not None
        states = 2 * e.model.arm.coordinates + numbers.law.states
        start = full_start(task, numbers)[:states]
        return cls(numbers.p, with_forces(numbers, task), *rows, start)
