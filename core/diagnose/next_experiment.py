"""The experiment that tells two effects apart, chosen before it is made.

Both fitted models are simulated on an experiment that was not made yet. Were one of them true,
the other would be refitted to it: what it can make good by its own parameters, by the nuisance
and without spoiling its fit to the recordings there are is projected out. The expected score is
what is left, LM = |(I - P)(y_A - y_B)|^2 / floor^2, the rise of the wrong one's squared error.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from ..diagnose.acceptance import Round
from ..diagnose.fit_problem import Data, Hypothesis, hypothesis
from ..identify.predictor import on_all_cores
from ..identify.prepared import prepare
from ..identify.unknowns import Unknown
from ..least_squares import normal_equations, pseudo_inverse
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

POINTS = (np.pi / 4.0, np.pi / 2.0, 3.0 * np.pi / 4.0)
"""rad, working points of an arm with an elbow."""

STRONGER = (1.0, 2.0)
"""Times the amplitude of the recordings there are."""

HOLDS = (0.02, 0.1)
"""s: a fast excitation, and one with stretches of steady motion."""

LONGEST = 3.0
"""s: as long as the recordings there are, but no longer."""


def possible(data: Data) -> tuple[SimulateSpec, ...]:
    """Variations of what was recorded: posture, amplitude, pace.

    None where a servo replays recorded torques: nobody knows what a new torque would be.
    """
    if data.bare.steering is not None:
        return ()
    recording = data.experiments[0].recording
    seconds = min(LONGEST, len(recording.time) * recording.sample_time)
    elbow = data.bare.arm.joints > 1
    size = _amplitude(data.bare, recording)
    dt = recording.sample_time
    return tuple(
        SimulateSpec(
            theta2=float(point) if elbow else None, amplitude=float(factor * size), hold=hold,
            seconds=float(round(seconds / dt) * dt), sample_time=float(dt),
        )
        for point, factor, hold in product(POINTS if elbow else (0.0,), STRONGER, HOLDS)
    )  # fmt: skip


def _amplitude(model: Model, recording: Recording) -> float:
    """Half the range of the references there were."""
    names = model.drive.reference_channels(model.arm)
    return max(float(np.ptp(recording[name])) / 2.0 for name in names) or 1.0


def planned_data(data: Data, spec: SimulateSpec) -> Data:
    """The data of an experiment to come: nothing is measured, everything counts."""
    return data_of(data, _recording(data.bare, spec, data.experiments[0].recording))


def data_of(data: Data, recording: Recording) -> Data:
    """The data of a recording that stands for an experiment to come."""
    like = data.experiments[0]
    prepared = prepare(data.bare, recording, like.outputs, like.processing)
    weights = np.array([1.0 / data.floors[name] for name, _ in prepared.channels])
    shared = [u for u in data.nuisance if u.recording is None]
    own = {u.parameter.name: u for u in data.nuisance if u.recording is not None}
    nuisance = (*shared, *[Unknown(u.parameter, NAME, u.searched) for u in own.values()])
    # Nothing takes the error of few steps off here, so there are as many as a statement needs.
    return replace(
        data,
        steps=data.fine,
        experiments=(prepared,),
        weights=(weights,),
        nuisance=nuisance,
        anchor=None,
    )


def _recording(model: Model, spec: SimulateSpec, like: Recording) -> Recording:
    """The channels that the recordings there are have, as often sampled; zero but for the
    references and the joints' start."""
    task, theta2 = make_task(model, spec, NAME)
    N = len(task.time)
    channels = {name: _blank(values, N) for name, values in like.channels.items()}
    for k, name in enumerate(model.drive.reference_channels(model.arm)):
        channels[name] = task.references[:, k]
    for k, place in enumerate(start_joints(model, spec, NAME)):
        if f"theta{k + 1}" in channels:
            channels[f"theta{k + 1}"] = np.full(N, place)
    return Recording(NAME, task.time, channels, theta2=theta2)


def expected_recording(
    model: Model, task: Task, theta2: float | None, motion: Trajectory, like: Recording
) -> Recording:
    """What the sensors of the recordings there are would read along a motion, as often sampled."""
    N, spec = len(task.time), SimulateSpec(sample_time=task.sample_time)
    read = read_sensors(model, motion, spec, NO_NOISE)
    channels = {n: _blank(values, N) + read.get(n, 0.0) for n, values in like.channels.items()}
    for k, name in enumerate(model.drive.reference_channels(model.arm)):
        channels[name] = task.references[:, k]
    return Recording(NAME, task.time, channels, theta2=theta2)


def _blank(values: np.ndarray, N: int) -> np.ndarray:
    """Zeros (N,), NaN between the samples of a slower sensor."""
    index = np.flatnonzero(np.isfinite(values))
    stride = max(int(np.median(np.diff(index))), 1) if index.size > 1 else 1
    return np.where(np.arange(N) % stride == 0, 0.0, np.nan)


Known = Mapping[tuple[str, str], float]
"""(label, label) -> entry of J'J"""


def next_experiments(
    data: Data,
    first: Hypothesis,
    second: Hypothesis,
    titles: tuple[str, str],
    candidates: Sequence[SimulateSpec],
    stopped: Callable[[], bool] = lambda: False,
) -> tuple[PlannedExperiment, ...]:
    """The candidates, best first; `first` and `second` stand at their fitted vectors."""
    known = list(on_all_cores(shared_normal_matrix, (first, second)))
    unit = channel_kind(data.bare.drive.reference_channels(data.bare.arm)[0]).units[0]

    def planned(spec: SimulateSpec) -> PlannedExperiment | None:
        if stopped():
            return None
        score = expected_score(data, first, second, spec, known)
        settings = spec.model_dump(exclude_defaults=True)
        return PlannedExperiment(settings, unit, score, titles)

    found = [one for one in on_all_cores(planned, candidates) if one is not None]
    return tuple(sorted(found, key=lambda e: -e.score))


def expected_score(
    data: Data,
    first: Hypothesis,
    second: Hypothesis,
    spec: SimulateSpec,
    known: Sequence[Known] = ({}, {}),
) -> float:
    """The score on one experiment, in floors squared; the smaller of the two ways round.

    `known` holds what the recordings there are say about each one's parameters.
    """
    return score_on(planned_data(data, spec), first, second, known)


def score_on(
    there: Data, first: Hypothesis, second: Hypothesis, known: Sequence[Known] = ({}, {})
) -> float:
    """The same, of an experiment whose data are known."""
    pair = [on_data(there, h) for h in (first, second)]
    outputs = [h.residuals.predictor.predict(h.vector)[0] for h in pair]
    if not all(np.all(np.isfinite(y)) for y in outputs):
        return 0.0  # a model that does not hold together there decides nothing
    prepared, weights = there.experiments[0], there.weights[0]
    apart = np.where(prepared.counted, outputs[0] - outputs[1], 0.0) * weights
    return min(_left(h, apart, i) for h, i in zip(pair, known, strict=True))


def shared_normal_matrix(h: Hypothesis) -> Known:
    """J'J of the recordings there are, for the parameters that a new one shares with them."""
    A, _ = normal_equations(h.errors(h.vector), h.slopes(h.vector))
    # What belongs to one recording is free to follow: it is eliminated, not held.
    own = [i for i, u in enumerate(h.unknowns.items) if u.recording is not None]
    shared = [i for i, u in enumerate(h.unknowns.items) if u.recording is None]
    B = A[np.ix_(shared, own)]
    kept = A[np.ix_(shared, shared)] - B @ pseudo_inverse(A[np.ix_(own, own)]) @ B.T
    labels = [h.unknowns.labels[i] for i in shared]
    return {(a, b): float(kept[i, j]) for i, a in enumerate(labels) for j, b in enumerate(labels)}


def on_data(there: Data, h: Hypothesis) -> Hypothesis:
    """A fitted model on another experiment."""
    own = tuple(u for u in h.unknowns.items if u.parameter.name in h.model.effect_parameters)
    shared = {k: v for k, v in h.values().items() if "@" not in k}
    return hypothesis(there, h.model.effects, {**h.model.effect_values, **shared}, freed=own)


def _left(h: Hypothesis, apart: np.ndarray, known: Known) -> float:
    """Squared error that a refit of `h` to the other's outputs leaves."""
    if not len(h.vector):
        return float(np.sum(apart**2))
    A, b = normal_equations([apart], h.slopes(h.vector))
    labels = h.unknowns.labels
    A += np.array([[known.get((i, j), 0.0) for j in labels] for i in labels])
    return max(float(np.sum(apart**2) - b @ pseudo_inverse(A) @ b), 0.0)


def deciding(
    found: Round, ranking: Sequence[RankedEffect], data: Data, progress: Progress
) -> tuple[PlannedExperiment, ...]:
    """Best first; none where nothing was found or nothing competes with it."""
    best = found.accepted
    if best is None:
        return ()
    named = next(r for r in ranking if r.effect == best.screened.effect.kind)
    competitors = [w for w in found.weighed if w.screened.effect.kind in named.confused_with[:1]]
    specs = possible(data)
    if not competitors or not specs:
        return ()
    progress.advance(0, "Planning the experiment that would decide")
    return next_experiments(
        data, best.refit.hypothesis, competitors[0].refit.hypothesis,
        (named.title, competitors[0].screened.effect.title), specs, progress.stopped,
    )  # fmt: skip
