"""The experiment that distinguishes two effects, chosen before it is made.

Both fitted models are simulated on a planned experiment. If one of them were true, the other would
be refitted to it. What its own parameters and the nuisance can absorb, without spoiling the fit to
the existing recordings, is projected out. The expected score is the remainder, LM = |(I - P)(y_A -
y_B)|^2 / floor^2: the increase of the wrong one's squared error (T-optimality: Atkinson and
Fedorov, Biometrika 62, 1975).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from ..diagnose.evidence import Round
from ..estimate.problem import FitData, Problem, problem_of
from ..identify.predictor import on_all_cores
from ..identify.prepared_recording import prepare
from ..identify.unknowns import Unknown
from ..least_squares import normal_equations, pseudo_inverse, with_prior
from ..model import Model
from ..progress import Progress
from ..recording.channels import channel_kind
from ..recording.recording import Recording
from ..recording.spec import SimulateSpec
from ..results import PlannedExperiment, RankedEffect
from ..simulate.experiment import NO_NOISE, make_task, read_sensors, start_joints
from ..simulate.motion import Task
from ..trajectory import Trajectory

NAME = "planned"

WORKING_POINTS = (np.pi / 4.0, np.pi / 2.0, 3.0 * np.pi / 4.0)
"""rad, working points of an arm with an elbow."""

STRONGER = (1.0, 2.0)
"""Factors on the amplitude of the existing recordings."""

HOLDS = (0.02, 0.1)
"""s: a fast excitation, and one with steady motion."""

LONGEST_EXPERIMENT = 3.0
"""s: as long as the existing recordings, but no longer."""


def possible_experiments(data: FitData) -> tuple[SimulateSpec, ...]:
    """Variations of the recorded experiments: posture, amplitude, hold time. None if a servo
    replays recorded torques: a new torque cannot be predicted."""
    if data.bare.steering is not None:
        return ()
    recording = data.experiments[0].recording
    seconds = min(LONGEST_EXPERIMENT, len(recording.time) * recording.sample_time)
    elbow = data.bare.arm.joints > 1
    size = _amplitude(data.bare, recording)
    dt = recording.sample_time
    return tuple(
        SimulateSpec(
            theta2=float(point) if elbow else None, amplitude=float(factor * size), hold=hold,
            seconds=float(round(seconds / dt) * dt), sample_time=float(dt),
        )
        for point, factor, hold in product(WORKING_POINTS if elbow else (0.0,), STRONGER, HOLDS)
    )  # fmt: skip


def _amplitude(model: Model, recording: Recording) -> float:
    """Half the range of the recorded references."""
    names = model.drive.reference_channels(model.arm)
    return max(float(np.ptp(recording[name])) / 2.0 for name in names) or 1.0


def planned_data(data: FitData, spec: SimulateSpec) -> FitData:
    """The data of a planned experiment: everything counts."""
    return data_for_recording(data, _recording(data.bare, spec, data.experiments[0].recording))


def data_for_recording(data: FitData, recording: Recording) -> FitData:
    """The data of a recording that represents a planned experiment."""
    like = data.experiments[0]
    prepared = prepare(data.bare, recording, like.outputs, like.processing)
    weights = np.array([1.0 / data.floors[name] for name, _ in prepared.channels])
    shared = [u for u in data.nuisance if u.recording is None]
    own = {u.parameter.name: u for u in data.nuisance if u.recording is not None}
    nuisance = (*shared, *[Unknown(u.parameter, NAME, u.searched) for u in own.values()])
    # No anchor corrects the step error here, so as many substeps as results need.
    return replace(
        data, substeps=data.result_substeps, experiments=(prepared,), weights=(weights,),
        nuisance=nuisance, anchor=None,
    )  # fmt: skip


def _recording(model: Model, spec: SimulateSpec, like: Recording) -> Recording:
    """A recording with the channels and sample times of the existing ones; zero but for the
    references and the joints' start."""
    task, theta2 = make_task(model, spec, NAME)
    N = len(task.time)
    channels = {name: _zeros_like(values, N) for name, values in like.channels.items()}
    for k, name in enumerate(model.drive.reference_channels(model.arm)):
        channels[name] = task.references[:, k]
    for k, place in enumerate(start_joints(model, spec, NAME)):
        if f"theta{k + 1}" in channels:
            channels[f"theta{k + 1}"] = np.full(N, place)
    return Recording(NAME, task.time, channels, theta2=theta2)


def expected_recording(
    model: Model, task: Task, theta2: float | None, motion: Trajectory, like: Recording
) -> Recording:
    """What the sensors of the existing recordings would read along a motion; `theta2`: its working
    point in rad, if it has one."""
    N, spec = len(task.time), SimulateSpec(sample_time=task.sample_time)
    read = read_sensors(model, motion, spec, NO_NOISE)
    channels = {n: _zeros_like(values, N) + read.get(n, 0.0) for n, values in like.channels.items()}
    for k, name in enumerate(model.drive.reference_channels(model.arm)):
        channels[name] = task.references[:, k]
    return Recording(NAME, task.time, channels, theta2=theta2)


def _zeros_like(values: np.ndarray, N: int) -> np.ndarray:
    """Zeros (N,), NaN between the samples of a slower sensor."""
    index = np.flatnonzero(np.isfinite(values))
    stride = max(int(np.median(np.diff(index))), 1) if index.size > 1 else 1
    return np.where(np.arange(N) % stride == 0, 0.0, np.nan)


NormalMatrix = Mapping[tuple[str, str], float]
"""(label, label) -> entry of J'J"""


def next_experiments(
    data: FitData, first: Problem, second: Problem, titles: tuple[str, str],
    candidates: Sequence[SimulateSpec], stopped: Callable[[], bool] = lambda: False,
) -> tuple[PlannedExperiment, ...]:  # fmt: skip
    """The planned experiments, best first; `first` and `second` are at their fitted vectors."""
    normal = list(on_all_cores(shared_normal_matrix, (first, second)))
    unit = channel_kind(data.bare.drive.reference_channels(data.bare.arm)[0]).units[0]

    def planned(spec: SimulateSpec) -> PlannedExperiment | None:
        if stopped():
            return None
        score = expected_score(data, first, second, spec, normal)
        settings = spec.model_dump(exclude_defaults=True)
        return PlannedExperiment(settings, unit, score, titles)

    plans = [plan for plan in on_all_cores(planned, candidates) if plan is not None]
    return tuple(sorted(plans, key=lambda e: -e.score))


def expected_score(
    data: FitData, first: Problem, second: Problem, spec: SimulateSpec,
    normal: Sequence[NormalMatrix] = ({}, {}),
) -> float:  # fmt: skip
    """The score on one experiment, in squared noise floors; the smaller of the two directions.
    `normal`: normal matrices of the existing recordings."""
    return score_on_data(planned_data(data, spec), first, second, normal)


def score_on_data(
    planned: FitData,
    first: Problem,
    second: Problem,
    normal: Sequence[NormalMatrix] = ({}, {}),
) -> float:
    """The score, in squared noise floors, on an experiment with its data."""
    pair = [problem_on(planned, problem) for problem in (first, second)]
    outputs = [problem.residuals.predictor.predict(problem.vector)[0] for problem in pair]
    if not all(np.all(np.isfinite(y)) for y in outputs):
        return 0.0  # a model that does not hold together there decides nothing
    prepared, weights = planned.experiments[0], planned.weights[0]
    difference = np.where(prepared.counted, outputs[0] - outputs[1], 0.0) * weights
    return min(_unabsorbed(problem, difference, i) for problem, i in zip(pair, normal, strict=True))


def shared_normal_matrix(problem: Problem) -> NormalMatrix:
    """J'J of the existing recordings, for the parameters that a new one shares with them."""
    equations = normal_equations(problem.errors(problem.vector), problem.slopes(problem.vector))
    A, _ = with_prior(*equations, problem.vector, problem.limits)
    # What belongs to one recording is free to follow: it is eliminated, not held.
    own = [i for i, u in enumerate(problem.unknowns.items) if u.recording is not None]
    shared = [i for i, u in enumerate(problem.unknowns.items) if u.recording is None]
    B = A[np.ix_(shared, own)]
    kept = A[np.ix_(shared, shared)] - B @ pseudo_inverse(A[np.ix_(own, own)]) @ B.T
    labels = [problem.unknowns.labels[i] for i in shared]
    return {(a, b): float(kept[i, j]) for i, a in enumerate(labels) for j, b in enumerate(labels)}


def problem_on(data: FitData, problem: Problem) -> Problem:
    """A fitted model on other data."""
    own = tuple(
        u for u in problem.unknowns.items if u.parameter.name in problem.model.effect_parameters
    )
    shared = {k: v for k, v in problem.values().items() if "@" not in k}
    return problem_of(
        data, problem.model.effects, {**problem.model.effect_values, **shared}, freed=own
    )


def _unabsorbed(problem: Problem, difference: np.ndarray, normal: NormalMatrix) -> float:
    """Squared error that remains after a refit of `h` to the other's outputs."""
    if not len(problem.vector):
        return float(np.sum(difference**2))
    A, b = normal_equations([difference], problem.slopes(problem.vector))
    labels = problem.unknowns.labels
    A += np.array([[normal.get((i, j), 0.0) for j in labels] for i in labels])
    return max(float(np.sum(difference**2) - b @ pseudo_inverse(A) @ b), 0.0)


def deciding_experiments(
    result: Round, ranking: Sequence[RankedEffect], data: FitData, progress: Progress
) -> tuple[PlannedExperiment, ...]:
    """Experiments that would decide between the accepted effect and its competitor, best first."""
    best = result.accepted
    if best is None:
        return ()
    named = next(r for r in ranking if r.effect == best.screened.effect.kind)
    competitors = [w for w in result.refitted if w.screened.effect.kind in named.confused_with[:1]]
    specs = possible_experiments(data)
    if not competitors or not specs:
        return ()
    progress.advance(0, "Planning the experiment that decides")
    return next_experiments(
        data, best.refit.problem, competitors[0].refit.problem,
        (named.title, competitors[0].screened.effect.title), specs, progress.stopped,
    )  # fmt: skip
