"""Predictions of a set of recordings from a parameter vector."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple, TypeVar

import numpy as np

from ..identify import prescribed_joint_forces
from ..identify.prepared_recording import Prepared
from ..identify.prescribed_joints import (
    fully_prescribed_motion,
    is_fully_prescribed,
    is_prescribed,
    prescribed_job,
)
from ..identify.unknowns import Unknowns
from ..model import Model, Numbers
from ..processors import thread_pool, workers
from ..progress import count_simulations
from ..recording.recording import Recording
from ..simulate.batch import Job, run_many
from ..simulate.linear import respond
from ..simulate.motion import Task
from ..trajectory import Trajectory

Item = TypeVar("Item")
Result = TypeVar("Result")

KEPT_MOTIONS = 3
"""Motions kept per recording: base, and the two sides of a difference."""


def on_all_cores(work: Callable[[Item], Result], which: Sequence[Item]) -> Iterator[Result]:
    """Results of the work in order; most of its time must be compiled code."""
    with thread_pool(len(which)) as pool:
        yield from pool.map(work, which)


Request = tuple[np.ndarray, Sequence[int]]
"""A vector (P,) and the indices of the experiments to predict with it."""

Motion = tuple[Trajectory, Numbers, dict[str, float]]

Key = tuple[int, int, bytes]
"""Key of a motion: identity of its recording, steps per sample, digest of all else."""


@dataclass(frozen=True)
class MotionCache:
    """Motions already simulated for other models with the same motion."""

    motions: Mapping[Key, Trajectory] = field(default_factory=dict)
    recordings: tuple[Recording, ...] = ()
    """Kept, so that their identities stay theirs."""


def job_of(model: Model, numbers: Numbers, task: Task) -> Job:
    """The simulation of an experiment; a virtual servo prescribes the joints."""
    if is_prescribed(model, numbers):
        return prescribed_job(model, numbers, task)
    return Job(model, numbers, task)


def motion_of(e: Prepared, numbers: Numbers, values: Mapping[str, float], steps: int) -> Trajectory:
    """The motion of one experiment with a fixed number of steps per sample."""
    moving, task = prescribed_joint_forces.simulated_part(e.model, numbers), e.task_at(values)
    if is_fully_prescribed(e.model, moving):
        motion = fully_prescribed_motion(e.model, moving, task)
    else:
        motion = run_many([job_of(e.model, moving, task)], steps)[0]
    return prescribed_joint_forces.with_prescribed_forces(e.model, numbers, motion, task.inputs)


class Moving(NamedTuple):
    """What is simulated for a prediction."""

    experiment: Prepared
    numbers: Numbers
    """Without forces at prescribed joints."""
    task: Task

    @property
    def parts(self) -> tuple[Model, Numbers, Task]:
        """Model, numbers and task."""
        return self.experiment.model, self.numbers, self.task

    @property
    def is_given(self) -> bool:
        """Whether the whole motion is prescribed, so that nothing is simulated."""
        return is_fully_prescribed(self.experiment.model, self.numbers)


@dataclass(frozen=True)
class Predictor:
    """Simulates prepared recordings at the level of their model."""

    experiments: Sequence[Prepared]
    unknowns: Unknowns
    fixed: Mapping[str, float] = field(default_factory=dict)
    steps: int = 1
    """Steps per sample, at the non-linear level."""
    motion_cache: MotionCache = field(default_factory=MotionCache)
    own: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Recording -> values that hold for it alone."""
    _motions: OrderedDict[Key, Trajectory] = field(default_factory=OrderedDict, init=False)
    _lock: threading.Lock = field(default_factory=threading.Lock, init=False, compare=False)

    @property
    def simulation_is_expensive(self) -> bool:
        """Whether simulations are expensive, so that one-sided differences pay."""
        return any(e.model.level == "nonlinear" for e in self.experiments)

    def values(self, experiment: Prepared, vector: np.ndarray) -> dict[str, float]:
        """Parameters of one recording by name at a `vector` (P,), those that are held too."""
        name = experiment.recording.name
        return {**self.fixed, **self.own.get(name, {}), **self.unknowns.values_for(name, vector)}

    def trajectories(self, requests: Sequence[Request]) -> list[list[Motion]]:
        """Per request the motions of its experiments; all are simulated together."""
        jobs = [(self.experiments[i], vector) for vector, which in requests for i in which]
        values = [self.values(e, vector) for e, vector in jobs]
        numbers = [e.model.numbers(v) for (e, _), v in zip(jobs, values, strict=True)]
        motions = self._simulate([e for e, _ in jobs], numbers, values)
        whole = [
            prescribed_joint_forces.with_prescribed_forces(e.model, n, motion, e.task.inputs)
            for (e, _), n, (_, motion) in zip(jobs, numbers, motions, strict=True)
        ]
        results = iter(zip(whole, numbers, values, strict=True))
        return [[next(results) for _ in which] for _, which in requests]

    def predict_many(self, requests: Sequence[Request]) -> list[list[np.ndarray]]:
        """Per request the outputs (M_i, k) of its experiments."""
        readings = self.readings(requests)
        return [
            [self.experiments[i].processed(raw) for i, raw in zip(which, each, strict=True)]
            for (_, which), each in zip(requests, readings, strict=True)
        ]

    def readings(self, requests: Sequence[Request]) -> list[list[np.ndarray]]:
        """Per request the outputs (N_i, k) of its experiments before they are filtered."""
        motions_of = self.trajectories(requests)
        return [
            [self.experiments[i].readings(*m) for i, m in zip(which, motions, strict=True)]
            for (_, which), motions in zip(requests, motions_of, strict=True)
        ]

    def predict(self, vector: np.ndarray) -> list[np.ndarray]:
        """(M_i, k) of all experiments at a `vector` (P,)."""
        return self.predict_many([(vector, range(len(self.experiments)))])[0]

    def _simulate(
        self, chosen: Sequence[Prepared], numbers: Sequence[Numbers],
        values: Sequence[Mapping[str, float]],
    ) -> list[tuple[Key, Trajectory]]:  # fmt: skip
        """Motions with their keys, each simulated once: sensor effects and forces at prescribed
        joints change no motion."""
        moving = self._moving(chosen, numbers, values)
        motions = self._known(moving)
        new = {key: each for key, each in moving if key not in motions}
        motions.update(zip(new, self._run(list(new.values())), strict=True))
        self.keep(motions, len(chosen))
        return [(key, motions[key]) for key, _ in moving]

    def _moving(
        self, chosen: Sequence[Prepared], numbers: Sequence[Numbers],
        values: Sequence[Mapping[str, float]],
    ) -> list[tuple[Key, Moving]]:  # fmt: skip
        """What moves, with the keys of the motions."""
        each = [
            Moving(e, prescribed_joint_forces.simulated_part(e.model, n), e.task_at(v))
            for e, n, v in zip(chosen, numbers, values, strict=True)
        ]
        return [(self._key(*moving), moving) for moving in each]

    def _known(self, moving: Sequence[tuple[Key, Moving]]) -> dict[Key, Trajectory]:
        """Motions that need no simulation."""
        with self._lock:
            known = {**self.motion_cache.motions, **self._motions}
        return {key: known[key] for key, _ in moving if key in known}

    def _numbers_at(self, vector: np.ndarray) -> tuple[list[Numbers], list[dict[str, float]]]:
        """Numbers and values of all experiments at a vector (P,)."""
        values = [self.values(e, vector) for e in self.experiments]
        return [e.model.numbers(v) for e, v in zip(self.experiments, values, strict=True)], values

    def missing_at(self, vector: np.ndarray) -> dict[Key, Moving]:
        """What is still to be simulated of all experiments at a vector (P,)."""
        moving = self._moving(self.experiments, *self._numbers_at(vector))
        known = self._known(moving)
        return {key: each for key, each in moving if key not in known}

    def keep(self, motions: Mapping[Key, Trajectory], most: int = 0) -> None:
        """Take motions that were simulated, also elsewhere; of those before as many stay as a few
        vectors need, and `most` of the new ones."""
        with self._lock:
            self._motions.update(motions)
            while len(self._motions) > most + KEPT_MOTIONS * len(self.experiments):
                self._motions.popitem(last=False)

    def _key(self, e: Prepared, numbers: Numbers, task: Task) -> Key:
        digest = prescribed_joint_forces.motion_digest(e.model, numbers, task, e.task)
        return id(e.recording), self.steps, digest

    def _run(self, moving: Sequence[Moving]) -> list[Trajectory]:
        if not moving:
            return []
        first = moving[0].experiment
        if first.model.level == "lpv":
            count_simulations(len(moving))
            return respond(first.model, [m.numbers for m in moving], [m.task for m in moving])
        if all(m.is_given for m in moving):
            return [fully_prescribed_motion(*m.parts) for m in moving]
        jobs = [job_of(*m.parts) for m in moving]
        return run_many(jobs, self.steps, workers())

    def simulated_at(self, vector: np.ndarray) -> MotionCache:
        """The motions at a vector (P,)."""
        motions = dict(self._simulate(self.experiments, *self._numbers_at(vector)))
        return MotionCache(motions, tuple(e.recording for e in self.experiments))

    def with_steps(self, steps: int) -> Predictor:
        """The same with so many steps per sample."""
        return replace(self, steps=steps)


def simulate_together(pairs: Sequence[tuple[Predictor, np.ndarray]]) -> None:
    """Simulate what each predictor needs at its vector (P,), with its number of steps; motions of
    one structure fill the lanes together. The predictors keep them for their next prediction."""
    groups: dict[int, list[tuple[Predictor, Key, Job]]] = {}
    for predictor, vector in pairs:
        for key, moving in predictor.missing_at(vector).items():
            if moving.experiment.model.level != "lpv" and not moving.is_given:
                group = groups.setdefault(predictor.steps, [])
                group.append((predictor, key, job_of(*moving.parts)))
    for steps, group in groups.items():
        motions = run_many([job for _, _, job in group], steps, workers())
        for (predictor, key, _), motion in zip(group, motions, strict=True):
            predictor.keep({key: motion})
