"""Predictions of a set of recordings from a parameter vector."""

from __future__ import annotations

import sys
import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from ..identify import prescribed_joint_forces
from ..identify.prepared_recording import Prepared
from ..identify.prescribed_joints import (
    fully_prescribed_motion,
    is_fully_prescribed,
    is_prescribed,
    prescribed_job,
)
from ..identify.processing import TORQUE
from ..identify.unknowns import Unknowns
from ..model import Model, Numbers
from ..processors import WORKERS
from ..recording.recording import Recording
from ..simulate.batch import Job, run_many
from ..simulate.linear import respond
from ..simulate.motion import Task
from ..simulate.nonlinear import LEAST_GAIN, MOST_SUBSTEPS, run_many_extrapolated, simulate_many
from ..trajectory import Trajectory

Item = TypeVar("Item")
Result = TypeVar("Result")

FIT_TOLERANCE = 3e-6
"""m or rad, rms: simulation error where the steps are sought, a tenth of a good camera's noise. The
estimated error is stated with the result."""

TORQUE_TOLERANCE = 0.005
"""Share of the torque's rms, if a servo's torque is compared: the best models of real rigs miss
several per cent."""

KEPT_MOTIONS = 3
"""Motions kept per recording: base, and the two sides of a difference."""


@contextmanager
def single_threaded() -> Iterator[None]:
    """For a process with one core of its own beside others."""
    global _workers
    before, _workers = _workers, 1
    try:
        yield
    finally:
        _workers = before


def workers() -> int:
    """Threads that a computation may use."""
    return _workers


_workers = WORKERS


SWITCH_INTERVAL = 1e-4
"""s after which a waiting thread gets the interpreter. Short compiled calls wait for it when they
end: with Python's 5 ms two threads were no faster than one (EMPS 18.6 s, with this 14.4 s); shorter
brings no more."""


_SWITCH_LOCK = threading.Lock()
_previous_intervals: list[float] = []
"""The interval before each of those who shortened it."""


@contextmanager
def fast_thread_switching() -> Iterator[None]:
    """Shortens the interval while threads alternate between short compiled calls; the last of
    several restores it."""
    with _SWITCH_LOCK:
        _previous_intervals.append(
            sys.getswitchinterval() if not _previous_intervals else _previous_intervals[0]
        )
        sys.setswitchinterval(min(_previous_intervals[0], SWITCH_INTERVAL))
    try:
        yield
    finally:
        with _SWITCH_LOCK:
            before = _previous_intervals.pop()
            if not _previous_intervals:
                sys.setswitchinterval(before)


def on_all_cores(work: Callable[[Item], Result], which: Sequence[Item]) -> Iterator[Result]:
    """Results of the work in order; most of its time must be compiled code."""
    with ThreadPoolExecutor(_workers) as pool:
        yield from pool.map(work, which)


Request = tuple[np.ndarray, Sequence[int]]
"""A vector (P,) and the indices of the experiments to predict with it."""

Motion = tuple[Trajectory, Numbers, dict[str, float]]

Key = tuple[int, int | None, bytes]
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


FEWEST_EXTRAPOLATED = 4
"""Steps from which extrapolation costs no more than a plain pass."""


def run_extrapolated(jobs: Sequence[Job], steps: int, workers: int) -> list[Trajectory]:
    """As `run_many`, for motions without edges: extrapolation from a quarter and half of the steps
    is less work and two orders more accurate."""
    if steps < FEWEST_EXTRAPOLATED:
        return run_many(jobs, steps, workers)
    return run_many_extrapolated(jobs, steps // 2, workers)


def motion_of(e: Prepared, numbers: Numbers, values: Mapping[str, float], steps: int) -> Trajectory:
    """The motion of one experiment with a fixed number of steps per sample."""
    moving, task = prescribed_joint_forces.simulated_part(e.model, numbers), e.task_at(values)
    if is_fully_prescribed(e.model, moving):
        motion = fully_prescribed_motion(e.model, moving, task)
    else:
        motion = run_many([job_of(e.model, moving, task)], steps)[0]
    return prescribed_joint_forces.with_prescribed_forces(e.model, numbers, motion)


@dataclass(frozen=True)
class Predictor:
    """Simulates prepared recordings at the level of their model."""

    experiments: Sequence[Prepared]
    unknowns: Unknowns
    fixed: Mapping[str, float] = field(default_factory=dict)
    steps: int | None = None
    """Steps per sample of one plain pass; None: as many as the stated error needs. Diagnosis fixes
    them: friction and limits have edges, where extrapolation fails."""
    errors: dict[str, float] = field(default_factory=dict, init=False)
    """Estimated rms simulation error per recording in m or rad, non-linear level only."""
    motion_cache: MotionCache = field(default_factory=MotionCache)
    own: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """Recording -> values that hold for it alone."""
    _motions: OrderedDict[Key, Trajectory] = field(default_factory=OrderedDict, init=False)

    @property
    def simulation_is_expensive(self) -> bool:
        """Whether simulations are expensive, so that one-sided differences pay."""
        return any(e.model.level == "nonlinear" for e in self.experiments)

    def values(self, experiment: Prepared, vector: np.ndarray) -> dict[str, float]:
        """Parameters of one recording by name, those that are held too."""
        name = experiment.recording.name
        return {**self.fixed, **self.own.get(name, {}), **self.unknowns.values_for(name, vector)}

    def trajectories(self, requests: Sequence[Request]) -> list[list[Motion]]:
        """Per request the motions of its experiments; all are simulated together."""
        jobs = [(self.experiments[i], vector) for vector, which in requests for i in which]
        values = [self.values(e, vector) for e, vector in jobs]
        numbers = [e.model.numbers(v) for (e, _), v in zip(jobs, values, strict=True)]
        motions = self._simulate([e for e, _ in jobs], numbers, values)
        whole = [
            prescribed_joint_forces.with_prescribed_forces(e.model, n, motion)
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
        """(M_i, k) of all experiments."""
        return self.predict_many([(vector, range(len(self.experiments)))])[0]

    def _simulate(
        self, chosen: Sequence[Prepared], numbers: Sequence[Numbers],
        values: Sequence[Mapping[str, float]],
    ) -> list[tuple[Key, Trajectory]]:  # fmt: skip
        """Motions with their keys, each simulated once: sensor effects and forces at prescribed
        joints change no motion."""
        parts = [
            prescribed_joint_forces.simulated_part(e.model, n)
            for e, n in zip(chosen, numbers, strict=True)
        ]
        tasks = [e.task_at(v) for e, v in zip(chosen, values, strict=True)]
        keys = [self._key(*each) for each in zip(chosen, parts, tasks, strict=True)]
        first = {key: i for i, key in reversed(list(enumerate(keys)))}
        cached = self.motion_cache.motions
        self._motions.update({key: cached[key] for key in first if key in cached})
        new = [i for i, key in enumerate(keys) if key not in self._motions and first[key] == i]
        some = [chosen[i] for i in new]
        simulated = self._run(some, [parts[i] for i in new], [tasks[i] for i in new])
        for i, motion in zip(new, simulated, strict=True):
            self._motions[keys[i]] = motion
        motions = [(key, self._motions[key]) for key in keys]
        while len(self._motions) > len(chosen) + KEPT_MOTIONS * len(self.experiments):
            self._motions.popitem(last=False)
        return motions

    def _key(self, e: Prepared, moving: Numbers, task: Task) -> Key:
        return (
            id(e.recording),
            self.steps,
            prescribed_joint_forces.motion_digest(e.model, moving, task, e.task),
        )

    def _run(
        self, chosen: Sequence[Prepared], numbers: Sequence[Numbers], tasks: Sequence[Task]
    ) -> list[Trajectory]:
        if not chosen:
            return []
        if chosen[0].model.level == "lpv":
            return respond(chosen[0].model, numbers, tasks)
        models = [e.model for e in chosen]
        requests = list(zip(models, numbers, tasks, strict=True))
        if all(map(is_fully_prescribed, models, numbers)):
            return [fully_prescribed_motion(*each) for each in requests]
        jobs = [job_of(*each) for each in requests]
        if self.steps is not None:
            # Play has edges, and what is extrapolated across them imitated it on a rigid slide.
            prescribed = all(map(is_prescribed, models, numbers))
            smooth = prescribed and not any(n.elements for n in numbers)
            return (run_extrapolated if smooth else run_many)(jobs, self.steps, _workers)
        torque_compared = chosen[0].model.steering is not None and any(
            output.kind == TORQUE for output in chosen[0].outputs
        )
        share = TORQUE_TOLERANCE if torque_compared else np.inf
        results = simulate_many(jobs, FIT_TOLERANCE, share, _workers)
        for e, x in zip(chosen, results, strict=True):
            self.errors[e.recording.name] = x.error
        return [result.trajectory for result in results]

    def simulated_at(self, vector: np.ndarray) -> MotionCache:
        """The motions at a vector (P,)."""
        values = [self.values(e, vector) for e in self.experiments]
        numbers = [e.model.numbers(v) for e, v in zip(self.experiments, values, strict=True)]
        motions = dict(self._simulate(self.experiments, numbers, values))
        return MotionCache(motions, tuple(e.recording for e in self.experiments))

    def with_steps(self, steps: int) -> Predictor:
        """The same with so many steps per sample."""
        return replace(self, steps=steps)

    def coarsened(self, vector: np.ndarray) -> Predictor:
        """The same with few steps; the step error is corrected at the end
        (core.identify.defect_correction)."""
        spread = [_spread_of(e) for e in self.experiments]
        found = self.with_steps(1)
        coarse = found.predict(vector)
        while True:
            finer = found.with_steps(2 * (found.steps or 1))
            fine = finer.predict(vector)
            miss = self._largest_miss(fine, coarse, spread)
            enough = miss * LEAST_GAIN / (LEAST_GAIN - 1.0) <= SEARCH_SHARE
            if enough or (found.steps or 1) >= MOST_SUBSTEPS:
                return found
            found, coarse = finer, fine

    def _largest_miss(
        self, fine: Sequence[np.ndarray], coarse: Sequence[np.ndarray], spread: Sequence[np.ndarray]
    ) -> float:
        """Rms of what coarse outputs miss where samples count, over the channel's spread."""
        differences = [
            np.where(e.counted, a - b, 0.0)
            for e, a, b in zip(self.experiments, fine, coarse, strict=True)
        ]
        return max(float(np.max(_rms(x) / s)) for x, s in zip(differences, spread, strict=True))


SEARCH_SHARE = 0.05
"""Share of a channel's spread, rms: largest step error in a search. The last step corrects what
it moves the estimates by."""


def _rms(block: np.ndarray) -> np.ndarray:
    """(k,) over the samples of (M, k)."""
    return np.asarray(np.sqrt(np.mean(block * block, axis=0)))


def _spread_of(e: Prepared) -> np.ndarray:
    """(k,) of what was measured, one where nothing moves."""
    counted = [y[mask] for y, mask in zip(e.measured.T, e.counted.T, strict=True)]
    spread = np.array([np.std(y) if y.size else 0.0 for y in counted])
    return np.where(spread > 0.0, spread, 1.0)
